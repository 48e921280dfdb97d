//! Models as files: safetensors with the recipe in the header; of a training that can go on, Adam's moments
//! and the state of the training too.
//!
//! Files are written whole to a hidden name and then renamed: what bears the name is never half of one.

use crate::adam::Adam;
use crate::error::{Error, Result};
use crate::model::Model;
use crate::recipe::Recipe;
use crate::state::State;
use atlasfit::Stop;
use candle_core::{DType, Device, Tensor};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::path::Path;

/// The key in the header that says what the file is, and the layout that this version writes.
const KIND: &str = "atlasfit-learn";
const VERSION: u32 = 1;
/// What the remedy is where a file is no model.
const ADVICE: &str = "Give a model that `atlasfit learn train` wrote";

/// How numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// 4 bytes each: training can go on.
    Single,
    /// 2 bytes each: for use.
    Half,
}

/// A file's content.
pub struct Loaded {
    /// The model.
    pub model: Model,
    /// How it was trained.
    pub recipe: Recipe,
    /// Where the training can go on.
    pub training: Option<(Adam, State)>,
}

/// What the header says.
#[derive(Serialize, Deserialize)]
struct Header {
    version: u32,
    recipe: Recipe,
    /// Steps of Adam.
    steps: u64,
    /// Where training stands; none in a model for use only.
    state: Option<State>,
}

/// The part of the header that every version has.
#[derive(Deserialize)]
struct Versioned {
    version: u32,
}

/// Numbers to write, by name.
type Numbers = Vec<(String, Vec<usize>, Vec<f32>)>;

fn numbers(model: &Model, adam: Option<&Adam>) -> Result<Numbers> {
    let flat = |t: &Tensor| t.flatten_all()?.to_vec1::<f32>();
    let mut all = Vec::new();
    for (name, var) in &model.params.vars {
        all.push((name.clone(), var.dims().to_vec(), flat(var.as_tensor())?));
    }
    for (name, moments) in &model.params.moments {
        let m = moments.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clone();
        for (what, values) in [("mean", flat(&m.get(0)?)?), ("variance", flat(&m.get(1)?)?)] {
            all.push((format!("{name}.{what}"), vec![values.len()], values));
        }
    }
    for (i, (name, var)) in model.params.vars.iter().enumerate() {
        let Some(adam) = adam else { break };
        for (k, what) in ["first", "second"].iter().enumerate() {
            let values = flat(&adam.moments[i].get(k)?)?;
            all.push((format!("adam.{what}.{name}"), var.dims().to_vec(), values));
        }
    }
    Ok(all)
}

/// The bytes of numbers in the order of the file, all at once: a model has tens of millions.
fn little_endian(values: &[f32]) -> Vec<u8> {
    let mut bytes = vec![0; 4 * values.len()];
    for (to, x) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(values) {
        *to = x.to_le_bytes();
    }
    bytes
}

/// The bytes of a model's file.
///
/// # Errors
/// Those of candle.
pub fn to_bytes(
    model: &Model,
    recipe: &Recipe,
    training: Option<(&Adam, &State)>,
    precision: Precision,
) -> Result<Vec<u8>> {
    let internal = |e: &dyn std::fmt::Display| atlasfit::Error::internal(format!("a model's header: {e}"));
    let header = Header {
        version: VERSION,
        recipe: recipe.clone(),
        steps: training.map_or(0, |t| t.0.steps),
        state: training.map(|t| t.1.clone()),
    };
    // One entry: the order of several is random.
    let header = serde_json::to_string(&header).map_err(|e| internal(&e))?;
    let header = HashMap::from([(KIND.to_owned(), header)]);
    let half = precision == Precision::Half;
    let tensors = numbers(model, training.map(|t| t.0))?
        .into_iter()
        .map(|(name, shape, values)| {
            // A running variance may lie beyond what half precision holds.
            let half = half && !name.ends_with(".variance") && !name.ends_with(".mean");
            let bytes = if half {
                let values = Tensor::from_vec(values, shape.clone(), &Device::Cpu)?.to_dtype(DType::F16)?;
                let bits = values.flatten_all()?.to_vec1::<half::f16>()?;
                bits.iter().flat_map(|x| x.to_le_bytes()).collect()
            } else {
                little_endian(&values)
            };
            Ok((name, if half { Dtype::F16 } else { Dtype::F32 }, shape, bytes))
        })
        .collect::<Result<Vec<_>>>()?;
    let views = tensors
        .iter()
        .map(|(name, kind, shape, bytes)| Ok((name, TensorView::new(*kind, shape.clone(), bytes)?)))
        .collect::<std::result::Result<Vec<_>, safetensors::SafeTensorError>>()
        .map_err(|e| internal(&e))?;
    Ok(safetensors::serialize(views, Some(header)).map_err(|e| internal(&e))?)
}

/// Writes a model's file.
///
/// # Errors
/// Files that cannot be written, a full disk; cancelled.
pub fn save(
    path: &Path,
    model: &Model,
    recipe: &Recipe,
    training: Option<(&Adam, &State)>,
    precision: Precision,
    stop: &Stop,
) -> Result<()> {
    let bytes = to_bytes(model, recipe, training, precision)?;
    Ok(atlasfit_io::write_file(path, &bytes, stop)?)
}

/// Reads a model's file.
///
/// # Errors
/// [`Error::BadFile`] where there is none, or it is damaged, half written or something else.
pub fn load(path: &Path, device: &Device) -> Result<Loaded> {
    let bytes = std::fs::read(path)
        .map_err(|e| Error::bad_file(path, format!("the model cannot be read ({e})"), ADVICE))?;
    from_bytes(&bytes, path, device)
}

/// Reads the bytes of a model's file; `name` names it in errors.
///
/// # Errors
/// As [`load`].
pub fn from_bytes(bytes: &[u8], name: &Path, device: &Device) -> Result<Loaded> {
    let bad = |what: String| Error::bad_file(name, what, ADVICE);
    let damaged = |e: safetensors::SafeTensorError| bad(format!("it is damaged or only half written ({e})"));
    let (_, header) = SafeTensors::read_metadata(bytes).map_err(damaged)?;
    let file = SafeTensors::deserialize(bytes).map_err(damaged)?;
    let Some(text) = header.metadata().as_ref().and_then(|m| m.get(KIND)) else {
        return Err(bad("it is no model of this program".into()));
    };
    let unread = |e: serde_json::Error| bad(format!("its header cannot be read ({e})"));
    let version: Versioned = serde_json::from_str(text).map_err(unread)?;
    if version.version != VERSION {
        return Err(bad(format!("it has the layout {}, not {VERSION}", version.version)));
    }
    let Header { recipe, state, steps, .. } = serde_json::from_str(text).map_err(unread)?;
    recipe.validate()?;
    let model = Model::new(&recipe.model, 0, device)?;
    let read = |tensor: &str, len: usize| -> Result<Vec<f32>> {
        let view = file.tensor(tensor).map_err(|e| bad(e.to_string()))?;
        let values: Vec<f32> = match view.dtype() {
            Dtype::F32 => view.data().as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect(),
            Dtype::F16 => {
                view.data().as_chunks::<2>().0.iter().map(|b| half::f16::from_le_bytes(*b).to_f32()).collect()
            }
            other => return Err(bad(format!("{tensor} is of the type {other:?}"))),
        };
        if values.len() != len {
            return Err(bad(format!("{tensor} has {} numbers, not {len}", values.len())));
        }
        if values.iter().any(|x| !x.is_finite()) {
            return Err(bad(format!("{tensor} holds a number that is not finite")));
        }
        Ok(values)
    };
    // Two of `len` numbers, one after the other.
    let pair = |[one, other]: [String; 2], len: usize| -> Result<Vec<f32>> {
        let mut both = read(&one, len)?;
        both.extend(read(&other, len)?);
        Ok(both)
    };
    for (name, var) in &model.params.vars {
        let values = read(name, var.elem_count())?;
        var.set(&Tensor::from_vec(values, var.shape(), device)?)?;
    }
    for (name, moments) in &model.params.moments {
        let mut m = moments.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let both = pair(["mean", "variance"].map(|what| format!("{name}.{what}")), m.elem_count() / 2)?;
        *m = Tensor::from_vec(both, m.shape(), device)?;
    }
    let training = match state {
        Some(state) => {
            let moments = model
                .params
                .vars
                .iter()
                .map(|(name, var)| {
                    let n = var.elem_count();
                    let names = ["first", "second"].map(|what| format!("adam.{what}.{name}"));
                    Ok(Tensor::from_vec(pair(names, n)?, (2, n), device)?)
                })
                .collect::<Result<_>>()?;
            Some((Adam { steps, moments }, state))
        }
        None => None,
    };
    Ok(Loaded { model, recipe, training })
}

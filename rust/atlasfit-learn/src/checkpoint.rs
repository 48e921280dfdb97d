//! Models as files: safetensors with the recipe in the header; of a training that can go on, Adam's moments and
//! the state of the training too.
//!
//! Files are written whole to a hidden name and then renamed: what bears the name is never half of one.

use crate::adam::Adam;
use crate::error::{Error, Result};
use crate::model::Model;
use crate::recipe::Recipe;
use crate::train::State;
use atlasfit::Stop;
use candle_core::{DType, Device, Tensor};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use std::collections::HashMap;
use std::path::Path;

/// The key in the header that says what the file is, and the layout that this version writes.
const KIND: &str = "atlasfit-learn";
const VERSION: &str = "1";
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
        for (what, values) in [("mean", m.mean), ("variance", m.variance)] {
            all.push((format!("{name}.{what}"), vec![values.len()], values));
        }
    }
    for (i, (name, var)) in model.params.vars.iter().enumerate() {
        let Some(adam) = adam else { break };
        for (what, values) in ["first", "second"].iter().zip(&adam.moments[i]) {
            all.push((format!("adam.{what}.{name}"), var.dims().to_vec(), values.clone()));
        }
    }
    Ok(all)
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
    let json = |value: serde_json::Result<String>| value.map_err(|e| internal(&e));
    let mut header = HashMap::from([(KIND.to_owned(), VERSION.to_owned())]);
    header.insert("recipe".into(), json(serde_json::to_string(recipe))?);
    if let Some((adam, state)) = training {
        header.insert("state".into(), json(serde_json::to_string(state))?);
        header.insert("steps".into(), adam.steps.to_string());
    }
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
                values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>()
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
    let header = header.metadata().clone().unwrap_or_default();
    match header.get(KIND).map(String::as_str) {
        Some(VERSION) => {}
        Some(other) => return Err(bad(format!("it has the layout {other}, not {VERSION}"))),
        None => return Err(bad("it is no model of this program".into())),
    }
    let recipe: Recipe = serde_json::from_str(header.get("recipe").map_or("", String::as_str))
        .map_err(|e| bad(format!("its recipe cannot be read ({e})")))?;
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
    for (name, var) in &model.params.vars {
        let values = read(name, var.elem_count())?;
        var.set(&Tensor::from_vec(values, var.shape(), device)?)?;
    }
    for (name, moments) in &model.params.moments {
        let mut m = moments.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let n = m.mean.len();
        m.mean = read(&format!("{name}.mean"), n)?;
        m.variance = read(&format!("{name}.variance"), n)?;
    }
    let training = match header.get("state") {
        Some(state) => {
            let state = serde_json::from_str(state)
                .map_err(|e| bad(format!("the state of the training cannot be read ({e})")))?;
            let steps = header.get("steps").and_then(|s| s.parse().ok()).unwrap_or(0);
            let moments = model
                .params
                .vars
                .iter()
                .map(|(name, var)| {
                    let of = |what: &str| read(&format!("adam.{what}.{name}"), var.elem_count());
                    Ok([of("first")?, of("second")?])
                })
                .collect::<Result<_>>()?;
            Some((Adam { steps, moments }, state))
        }
        None => None,
    };
    Ok(Loaded { model, recipe, training })
}

//! Writes a made-up shape: `cargo run -p atlasfit-learn --example shape -- chair 365 chair.ply`. The number
//! is that of the shape in the family, as collections of the data seed 1 count them: from 360 on they are in
//! the test split of the recipe `quick`.

use atlasfit_learn::data::seed_of;
use atlasfit_learn::shapes::{Family, Shape};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [family, number, file] = &args[..] else { return Err("give a family, a number and a file".into()) };
    let family = Family::ALL.into_iter().find(|f| f.name() == family).ok_or("no such family")?;
    let shape = Shape::new(family, seed_of(1, number.parse()?));
    atlasfit_io::save_mesh(file.as_ref(), &shape.mesh().0, &atlasfit_io::SaveMesh::default())?;
    Ok(())
}

//! Every function of the header, called with NULL, wrong sizes, absurd counts, wrong handles: a status and a
//! text, never a crash.

#[path = "../scene/mod.rs"]
mod scene;

mod atlas;
mod baking;
mod buffers;
mod denoising;
mod files;
mod general;
mod measuring;
mod simplifying;
mod table;
mod uvs;

use scene::*;
use table::Table;

#[test]
fn every_function_answers_hostile_arguments_with_a_status() {
    let s = Scene::new(1500);
    let mut t = Table::default();
    for part in [
        general::names,
        general::structs_and_handles,
        denoising::arguments,
        denoising::columns,
        denoising::getters,
        atlas::questions,
        atlas::bytes,
        uvs::arguments,
        uvs::getters,
        measuring::meshes,
        baking::arguments,
        baking::textures,
        buffers::copies,
        measuring::distances,
        files::reading,
        files::writing,
        simplifying::arguments,
        simplifying::getters,
    ] {
        part(&mut t, &s);
    }
    let wrong: Vec<String> = (t.calls.iter().filter(|c| c.want != c.got))
        .map(|c| format!("{}, {}: {} instead of {}", c.function, c.case, c.got, c.want))
        .collect();
    assert!(wrong.is_empty(), "{} of {} calls:\n{}", wrong.len(), t.calls.len(), wrong.join("\n"));
    let mut called: Vec<String> = t.calls.iter().map(|c| c.function.to_owned()).collect();
    called.sort();
    called.dedup();
    assert_eq!(called, declared(), "the table and the header's functions differ");
}

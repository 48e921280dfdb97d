//! What helps to install the program: version, completions, manual pages, doctor.

mod common;

use common::{Folder, err, out, run};
use serde_json::Value;

#[test]
fn the_version_says_build_features_and_licence() {
    let long = out(&run(&[&"--version"]));
    let begins: Vec<&str> = long.lines().filter_map(|l| l.split_whitespace().next()).collect();
    assert_eq!(begins, ["atlasfit", "build", "features", "licence"], "{long}");
    assert!(long.contains(std::env::consts::ARCH) && long.contains(env!("CARGO_PKG_VERSION")), "{long}");
    let short = out(&run(&[&"-V"]));
    assert_eq!(short.lines().count(), 1, "{short}");
}

#[test]
fn every_shell_gets_a_script_and_others_are_refused() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let done = run(&[&"completions", &shell]);
        let script = out(&done);
        assert!(done.status.success() && script.contains("unwrap"), "{shell}");
        assert!(script.contains("max-stretch"), "{shell}: options are missing");
    }
    let refused = run(&[&"completions", &"dos"]);
    assert_eq!(refused.status.code(), Some(2), "{}", err(&refused));
}

#[test]
fn every_command_has_a_manual_page() {
    let folder = Folder::new("man");
    let done = run(&[&"man", &folder.0, &"--json"]);
    let told: Value = serde_json::from_slice(&done.stdout).unwrap();
    let names = folder.names();
    assert_eq!(told["files"].as_array().map(Vec::len), Some(names.len()));
    let help = out(&run(&[&"--help"]));
    let listed = help.lines().skip_while(|l| !l.starts_with("Commands:")).skip(1);
    let commands: Vec<&str> = listed
        .take_while(|l| !l.starts_with("Options:"))
        .filter(|l| l.starts_with("  ") && !l.starts_with("   "))
        .filter_map(|l| l.split_whitespace().next())
        .filter(|name| *name != "help")
        .collect();
    assert!(commands.len() > 10, "{help}");
    for command in commands {
        let name = format!("atlasfit-{command}.1");
        assert!(names.contains(&name), "{name} is missing: {names:?}");
        let page = std::fs::read_to_string(folder.0.join(&name)).unwrap();
        assert!(
            page.contains(&format!(".TH atlasfit-{command} 1")) && page.contains(".SH OPTIONS"),
            "{page}"
        );
    }
}

#[test]
fn doctor_tells_what_is_there_and_does_a_job() {
    let done = run(&[&"doctor", &"--json", &"--threads", &"1"]);
    let told: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert!(done.status.success(), "{}", err(&done));
    assert_eq!(told["threads"], 1);
    assert!(told["vector_lanes"].as_u64().is_some_and(|n| n >= 1));
    assert!(told["features"]["learn"].is_boolean() && told["seconds"].as_f64().is_some_and(|s| s > 0.0));
    let text = out(&run(&[&"doctor"]));
    assert!(text.contains("it works") && text.contains("licence"), "{text}");
}

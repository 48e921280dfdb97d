//! Progress and cancel.

use crate::ok;
use crate::scene::*;
use atlasfit_capi::denoise::*;
use atlasfit_capi::log::*;
use atlasfit_capi::result::*;
use atlasfit_capi::run::*;
use atlasfit_capi::simplify::*;
use atlasfit_capi::status::*;
use std::ffi::{CStr, c_char, c_void};
use std::ptr::{null, null_mut};

#[test]
fn progress_comes_on_the_calling_thread_and_a_token_cancels_from_another() {
    struct Seen {
        thread: std::thread::ThreadId,
        calls: usize,
        stages: u32,
    }
    unsafe extern "C" fn tell(user: *mut c_void, stage: u32, fraction: f64) -> i32 {
        let seen = unsafe { &mut *user.cast::<Seen>() };
        assert_eq!(std::thread::current().id(), seen.thread);
        assert!((0.0..=1.0).contains(&fraction));
        seen.calls += 1;
        seen.stages |= 1 << stage;
        1
    }
    let xyz = scan(20_000);
    let mut seen = Seen { thread: std::thread::current().id(), calls: 0, stages: 0 };
    let run = atlasfit_run {
        progress: Some(tell),
        progress_user: (&raw mut seen).cast(),
        ..init(atlasfit_run_init)
    };
    let mut result = null_mut();
    ok(unsafe { atlasfit_denoise(&points(&xyz), null(), &run, &mut result) });
    ok(unsafe { atlasfit_result_free(result) });
    assert!(seen.calls > 3 && seen.stages.count_ones() > 2);

    let mut token = null_mut();
    ok(unsafe { atlasfit_cancel_new(&mut token) });
    let run = atlasfit_run { cancel: token, ..init(atlasfit_run_init) };
    let from_elsewhere = token.expose_provenance();
    let canceller = std::thread::spawn(move || {
        std::thread::sleep(std::time::Duration::from_millis(50));
        unsafe { atlasfit_cancel_request(std::ptr::with_exposed_provenance(from_elsewhere)) }
    });
    // Cancelled before it begins or in its midst, as the clock will have it.
    let status = unsafe { atlasfit_denoise(&points(&scan(60_000)), null(), &run, &mut result) };
    assert_eq!(canceller.join().expect("the canceller ends"), ATLASFIT_OK);
    assert_eq!((status, result.is_null()), (ATLASFIT_CANCELLED, true));
    ok(unsafe { atlasfit_cancel_free(token) });
}

/// What a log was told.
type Lines = Vec<(u32, String)>;

unsafe extern "C" fn keep(user: *mut c_void, level: u32, text: *const c_char) {
    // A log may call the library: what that call says is not the log's.
    assert_eq!(unsafe { atlasfit_cancel_free(7 as *mut atlasfit_cancel) }, ATLASFIT_INVALID_HANDLE);
    let text = unsafe { CStr::from_ptr(text) }.to_str().expect("UTF-8").to_owned();
    unsafe { &mut *user.cast::<Lines>() }.push((level, text));
}

/// A run that tells the log.
fn logged(lines: &mut Lines) -> atlasfit_run {
    atlasfit_run { log: Some(keep), log_user: (&raw mut *lines).cast(), ..init(atlasfit_run_init) }
}

#[test]
fn the_log_of_a_call_is_told_stages_warnings_and_why_it_fails_and_no_other_call_is() {
    let (mut lines, mut result) = (Lines::new(), null_mut());
    ok(unsafe { atlasfit_denoise(&points(&scan(20_000)), null(), &logged(&mut lines), &mut result) });
    ok(unsafe { atlasfit_result_free(result) });
    let info: Vec<&str> = lines.iter().filter(|l| l.0 == ATLASFIT_LOG_INFO).map(|l| l.1.as_str()).collect();
    assert!(info.len() > 2 && info.contains(&"fitting charts"), "{lines:?}");
    assert!(info.windows(2).all(|w| w[0] != w[1]), "each stage once as it begins: {lines:?}");

    // A box cannot have two triangles.
    lines.clear();
    let (xyz, triangles) = cube();
    let options = atlasfit_simplify_options { faces: 2, ..init(atlasfit_simplify_options_init) };
    let mut light = null_mut();
    ok(unsafe { atlasfit_simplify(&mesh(&xyz, &triangles), &options, &logged(&mut lines), &mut light) });
    ok(unsafe { atlasfit_simplified_free(light) });
    let warned = |l: &&(u32, String)| l.0 == ATLASFIT_LOG_WARNING && l.1.contains("triangles are left");
    assert_eq!(lines.iter().filter(warned).count(), 1, "{lines:?}");

    lines.clear();
    let status = unsafe { atlasfit_denoise(&points(&[]), null(), &logged(&mut lines), &mut result) };
    assert_eq!(status, ATLASFIT_EMPTY_INPUT);
    assert_eq!(lines.last(), Some(&(ATLASFIT_LOG_ERROR, last_error())));
    lines.clear();
    // The log was the call's.
    assert_ne!(unsafe { atlasfit_denoise(&points(&[]), null(), null(), &mut result) }, ATLASFIT_OK);
    assert!(lines.is_empty(), "{lines:?}");
}

/// The threads of this process.
#[cfg(target_os = "linux")]
fn threads() -> usize {
    std::fs::read_dir("/proc/self/task").expect("Linux has it").count()
}

#[test]
#[cfg(target_os = "linux")]
fn a_call_has_no_more_threads_than_it_is_given_beside_the_one_that_waits() {
    unsafe extern "C" fn count(user: *mut c_void, _: u32, _: f64) -> i32 {
        let most = unsafe { &mut *user.cast::<usize>() };
        *most = (*most).max(threads());
        1
    }
    // Alone in a process: the other tests have threads too.
    if std::env::var_os("ATLASFIT_ALONE").is_none() {
        let me = std::env::current_exe().expect("it runs");
        let name = "running::a_call_has_no_more_threads_than_it_is_given_beside_the_one_that_waits";
        let mut alone = std::process::Command::new(me);
        alone.args([name, "--exact", "--test-threads=1"]).env("ATLASFIT_ALONE", "1");
        let done = alone.output().expect("it starts");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stdout));
        return;
    }
    let (before, mut most, mut result) = (threads(), 0usize, null_mut());
    let run = atlasfit_run {
        threads: 3,
        progress: Some(count),
        progress_user: (&raw mut most).cast(),
        ..init(atlasfit_run_init)
    };
    ok(unsafe { atlasfit_denoise(&points(&scan(20_000)), null(), &run, &mut result) });
    ok(unsafe { atlasfit_result_free(result) });
    // Three that work, and one that waits for them.
    assert!((1..=4).contains(&(most - before)), "{most} {before}");
    // The system lists one that has ended for a moment longer.
    for _ in 0..1000 {
        if threads() <= before {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    panic!("{} threads are left of {before}", threads());
}

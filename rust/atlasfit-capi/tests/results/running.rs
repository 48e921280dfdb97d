//! Progress and cancel.

use crate::ok;
use crate::scene::*;
use atlasfit_capi::denoise::*;
use atlasfit_capi::result::*;
use atlasfit_capi::run::*;
use atlasfit_capi::status::*;
use std::ptr::{null, null_mut};

#[test]
fn progress_comes_on_the_calling_thread_and_a_token_cancels_from_another() {
    use std::ffi::c_void;
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

#![no_main]

#[path = "../targets.rs"]
#[allow(dead_code, reason = "one target is wanted of six")]
mod targets;

libfuzzer_sys::fuzz_target!(|data: &[u8]| targets::matrix(data));

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| papilla_oip::fuzz::request(data));

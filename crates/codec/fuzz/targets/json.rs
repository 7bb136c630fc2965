#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| papilla_codec::fuzz::json(data));

//! Lists the files that go into the binary: the shipped models, the page and the WebXR scene.
//!
//! The lists are made here rather than written by hand, so that a model or a
//! page module is added by putting its file into the folder.

use std::{
    env,
    error::Error,
    fs,
    path::{Path, PathBuf},
};

fn main() -> Result<(), Box<dyn Error>> {
    let root = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?);
    let out = PathBuf::from(env::var("OUT_DIR")?);
    embed(files(&root.join("../models"), &["onnx", "json", "contact"])?, &out.join("models.rs"))?;
    let endings = ["html", "css", "mjs", "js", "svg", "png", "json", "ico", "woff2", "webp", "txt"];
    let mut page = files(&root.join("web"), &endings)?;
    // The web client's: the page has its connection, its atlas and its pixels. What needs three.js
    // is in web/ in its place, bundled to import the three.js there.
    let own = page.clone();
    let is_bundled = |path: &PathBuf| own.iter().any(|file| file.file_name() == path.file_name());
    let client = files(&root.join("../clients/web/src"), &["js"])?;
    page.extend(client.into_iter().filter(|path| !is_bundled(path)));
    embed(page, &out.join("page.rs"))?;
    embed(files(&root.join("web/xr"), &["html", "js"])?, &out.join("scene.rs"))?;
    Ok(())
}

/// Every file in `folder` with one of the `endings`.
fn files(folder: &Path, endings: &[&str]) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    println!("cargo:rerun-if-changed={}", folder.display());
    let mut files = Vec::new();
    if folder.is_dir() {
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
            if path.is_file() && endings.contains(&ending) {
                files.push(path.canonicalize()?);
            }
        }
    }
    Ok(files)
}

/// Writes an expression of type `&[(&str, &[u8])]`: name and bytes of every
/// file, sorted by path.
fn embed(mut files: Vec<PathBuf>, into: &Path) -> Result<(), Box<dyn Error>> {
    files.sort();
    let mut list = String::from("&[\n");
    for path in files {
        let name = path.file_name().and_then(|n| n.to_str()).ok_or("a file name is not UTF-8")?;
        let path = path.to_str().ok_or("a path is not UTF-8")?;
        list.push_str(&format!("    ({name:?}, include_bytes!({path:?}).as_slice()),\n"));
    }
    list.push_str("]\n");
    fs::write(into, list)?;
    Ok(())
}

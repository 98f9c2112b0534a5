//! Notes of which sources the extension is built, so that a stale one is told from the one that the tests are meant for.

use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let manifest = env::var("CARGO_MANIFEST_DIR").map_err(io::Error::other)?;
    let rust = Path::new(&manifest).join("..");
    println!("cargo:rerun-if-changed={}", rust.display());
    let mut files = Vec::new();
    collect(&rust, &mut files)?;
    let mut named: Vec<(String, PathBuf)> = files
        .into_iter()
        .filter_map(|path| {
            let relative = path.strip_prefix(&rust).ok()?.to_str()?.replace('\\', "/");
            Some((relative, path))
        })
        .collect();
    named.sort();
    // FNV-1a, 64 bits: the tests compute it again.
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for (name, path) in named {
        for byte in name.into_bytes().into_iter().chain(fs::read(path)?) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
    println!("cargo:rustc-env=PEGBAR_SOURCES={hash:016x}");
    Ok(())
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|kind| kind == "rs") {
            files.push(path);
        }
    }
    Ok(())
}

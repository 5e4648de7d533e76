//! Finds PETSc and MPI and compiles the one C file that calls them; without them the crate builds all
//! the same, and the program says what is missing.

fn main() {
    println!("cargo:rerun-if-changed=src/petsc.c");
    println!("cargo:rustc-check-cfg=cfg(petsc)");
    watch_packages();
    if let Err(missing) = link() {
        println!("cargo:rustc-env=MISSING={missing}");
    }
}

/// Looks again when a package comes or goes.
fn watch_packages() {
    println!("cargo:rerun-if-env-changed=PKG_CONFIG_PATH");
    let folders = pkg_config::get_variable("pkg-config", "pc_path").unwrap_or_default();
    for folder in folders.split(':').filter(|folder| std::path::Path::new(folder).is_dir()) {
        println!("cargo:rerun-if-changed={folder}");
    }
}

/// Compiles and links; else the name of what is missing.
fn link() -> Result<(), &'static str> {
    let probe = |name: &str| pkg_config::Config::new().cargo_metadata(false).probe(name).ok();
    let petsc = pkg_config::Config::new()
        .cargo_metadata(false)
        .atleast_version("3.18")
        .probe("PETSc")
        .map_err(|_| "PETSc 3.18 or later")?;
    let mpi = ["ompi-c", "ompi", "mpich"].into_iter().find_map(probe).ok_or("MPI")?;
    let mut c = cc::Build::new();
    c.file("src/petsc.c").includes(&petsc.include_paths).includes(&mpi.include_paths);
    c.warnings(false).try_compile("softgrasp_petsc").map_err(|_| "a C compiler")?;
    // Behind the static part, which needs them.
    for library in [petsc, mpi] {
        for path in &library.link_paths {
            println!("cargo:rustc-link-search=native={}", path.display());
        }
        for name in &library.libs {
            println!("cargo:rustc-link-lib={name}");
        }
    }
    println!("cargo:rustc-cfg=petsc");
    Ok(())
}

//! Compiles the proto files: messages and servers, and the descriptors that reflection tells. Tells the
//! package which compiler and profile it is built with.

#[cfg(feature = "edge")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    tell_build();
    proto::compile()
}

#[cfg(not(feature = "edge"))]
fn main() {
    tell_build();
    println!("cargo::rerun-if-changed=build.rs");
}

/// Compiler and profile, which a report of measurements names.
#[expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "cargo tells a build script by the environment, and the compiler by its answer"
)]
fn tell_build() {
    let compiler = std::env::var_os("RUSTC")
        .and_then(|rustc| {
            let told = std::process::Command::new(rustc).arg("--version").output();
            String::from_utf8(told.ok()?.stdout).ok()
        })
        .unwrap_or_default();
    // The profile's own name is told by the folder alone: `target/<profile>/build/<package>/out`.
    let profile = std::env::var_os("OUT_DIR").and_then(|folder| {
        let folder = std::path::PathBuf::from(folder);
        let name = folder.ancestors().nth(3)?.file_name()?;
        name.to_str().map(str::to_owned)
    });
    println!("cargo::rustc-env=SKYWAY_COMPILER={}", compiler.trim());
    // A bench is built in the folder of `release`, with other settings.
    let level = std::env::var("OPT_LEVEL").unwrap_or_default();
    println!(
        "cargo::rustc-env=SKYWAY_PROFILE={}, opt-level {level}",
        profile.unwrap_or_default()
    );
}

#[cfg(feature = "edge")]
mod proto {
    use protox::prost::Message;
    use std::error::Error;
    use std::path::PathBuf;

    const FOLDER: &str = "proto";
    const FILES: [&str; 10] = [
        "skyway/v1/airspace.proto",
        "skyway/v1/clock.proto",
        "skyway/v1/drones.proto",
        "skyway/v1/flight.proto",
        "skyway/v1/network.proto",
        "skyway/v1/plans.proto",
        "skyway/v1/recomposition.proto",
        "skyway/v1/session.proto",
        "skyway/v1/telemetry.proto",
        "skyway/v1/types.proto",
    ];

    pub(crate) fn compile() -> Result<(), Box<dyn Error>> {
        println!("cargo::rerun-if-changed=build.rs");
        println!("cargo::rerun-if-changed={FOLDER}");
        let descriptors = protox::compile(FILES, [FOLDER])?;
        write_descriptors(&descriptors.encode_to_vec())?;
        tonic_prost_build::configure()
            // Clients generate their own.
            .build_client(false)
            .build_transport(false)
            // The time of google.protobuf is generated beside ours: one crate less.
            .compile_well_known_types(true)
            .bytes(".skyway.v1.GetNetworkResponse.document")
            .emit_rerun_if_changed(false)
            .compile_fds(descriptors)?;
        Ok(())
    }

    #[expect(
        clippy::disallowed_methods,
        reason = "a build script writes where cargo tells it to"
    )]
    fn write_descriptors(encoded: &[u8]) -> Result<(), Box<dyn Error>> {
        let folder = std::env::var_os("OUT_DIR").ok_or("cargo gives no OUT_DIR")?;
        std::fs::write(
            PathBuf::from(folder).join("skyway_descriptors.bin"),
            encoded,
        )?;
        Ok(())
    }
}

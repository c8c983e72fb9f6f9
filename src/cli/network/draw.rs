//! `skyway network draw`: a network as a picture, with a failure and its answer if one is named.

use crate::cli::airspace_source::AirspaceArguments;
use crate::cli::failure::FailureArguments;
use crate::cli::files;
use crate::cli::method::{ParameterArguments, StrategyArguments};
use crate::cli::network_source::NetworkArguments;
use crate::cli::output::Output;
use crate::cli::picture::{PictureArguments, Scene};
use crate::cli::stop::{Stop, Verdict};
use crate::recompose::{Request, Scratch, World, recompose};
use clap::Args;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  skyway network draw -o sydney.svg
  skyway network draw --network corridor --width 1200 -o corridor.svg
  skyway network draw --network town.geojson --buildings buildings.geojson -o town.svg
  skyway network draw --service 379,406 --destination 450 --strategy two_phased --labels paths -o answer.svg";

/// Arguments of `skyway network draw`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Draw {
    #[command(flatten)]
    network: NetworkArguments,
    #[command(flatten)]
    airspace: AirspaceArguments,
    #[command(flatten)]
    failure: FailureArguments,
    #[command(flatten)]
    strategy: StrategyArguments,
    #[command(flatten)]
    parameters: ParameterArguments,
    #[command(flatten)]
    picture: PictureArguments,
    /// Where to write the SVG (.gz compresses), or - for standard output
    #[arg(
        help_heading = "Output",
        long,
        short,
        value_name = "FILE",
        default_value = "-"
    )]
    output: PathBuf,
}

impl Draw {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let network = self.network.load(output)?;
        let topology = &network.topology;
        let airspace = self.airspace.open(topology, output)?;
        let scene = Scene::of(&airspace)
            .with_buildings(self.picture.ground_plans(topology)?)
            .with_options(self.picture.options());
        if !self.failure.is_given() {
            return self.write(&scene, output);
        }
        let request = Request {
            explain: true,
            ..self
                .strategy
                .request(self.failure.report(topology)?, &self.parameters)?
        };
        let world = World {
            airspace: &airspace,
            trees: None,
        };
        let answer = recompose(&world, &request, &mut Scratch::new(topology));
        self.write(&scene.with_answer(&request.report, &answer), output)
    }

    fn write(&self, scene: &Scene<'_>, output: &Output) -> Result<Verdict, Stop> {
        files::write_text(&self.output, &scene.svg(), output)?;
        Ok(Verdict::Done)
    }
}

//! Where the figures come from.

use crate::evaluate::record::Provenance;
use maud::{Markup, html};

pub(super) fn section(provenance: &Provenance) -> Markup {
    let seed = provenance.seed.to_string();
    let assertions = match provenance.checks_assertions {
        true => "checked",
        false => "off",
    };
    let facts: [(&str, &str); 8] = [
        ("Version", &provenance.version),
        ("Commit", &provenance.commit),
        ("Compiler", &provenance.compiler),
        ("Profile", &provenance.profile),
        ("Assertions", assertions),
        ("Machine", &provenance.machine),
        ("Started", &provenance.started),
        ("Seed", &seed),
    ];
    let parameters = provenance.parameters.iter();
    let parameters = parameters.map(|(name, value)| (name.as_str(), value.as_str()));
    html! {
        section id="provenance" {
            h2 { "Provenance" }
            p { "This run was made by" }
            pre { code { (provenance.command) } }
            p {
                "The raw rows are in " code { "rows/" } ", one per failure and method; their summary is in "
                code { "summary.csv" } ", and all that this page shows is in " code { "run.json" } "."
            }
            table class="facts" {
                tbody {
                    @for (name, value) in facts.into_iter().chain(parameters) {
                        tr { th scope="row" { (name) } td { (value) } }
                    }
                }
            }
        }
    }
}

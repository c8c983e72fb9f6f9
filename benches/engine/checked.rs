//! The checker beside what it checks: an answer by distance, by its number of legs.

use crate::percentiles::{Percentiles, print_head};
use crate::workload::Workload;
use skyway::checked::{Known, check_answer};
use skyway::recompose::{Recomposition, Request, Scratch, World, recompose};

/// How many legs the answers have that are checked.
const LEGS: [usize; 3] = [10, 30, 100];
/// Answers of each length.
const ANSWERS: usize = 200;

/// Requests whose answers have a given number of legs, with those answers.
fn answers(
    workload: &Workload,
    legs: usize,
    scratch: &mut Scratch,
) -> Vec<(Request, Recomposition)> {
    let world = World {
        trees: None,
        ..workload.open_world()
    };
    let mut found = Vec::new();
    for failure in &workload.failures {
        let whole = recompose(&world, &failure.request, scratch);
        let Some(&end) = whole.path.nodes.get(legs) else {
            continue;
        };
        let mut request = failure.request.clone();
        request.report.destination = end;
        let answer = recompose(&world, &request, scratch);
        if answer.path.segments.len() == legs {
            found.push((request, answer));
        }
        if found.len() == ANSWERS {
            break;
        }
    }
    found
}

/// Prints what it takes to check answers, alone and beside their search.
pub(crate) fn measure(workload: &Workload) {
    let mut scratch = Scratch::new(&workload.topology);
    let known = Known::default();
    let world = workload.open_world();
    print_head("checked before it leaves");
    let count = workload.failures.len();
    let both = Percentiles::of(count, |index| {
        let request = &workload.failures[index].request;
        let answer = recompose(&world, request, &mut scratch);
        check_answer(world.airspace, request, &known, &answer, None).is_ok()
    });
    both.print("exact, table in memory, whole recomposition, checked");
    for legs in LEGS {
        let found = answers(workload, legs, &mut scratch);
        if found.is_empty() {
            continue;
        }
        let alone = Percentiles::of(found.len(), |index| {
            let (request, answer) = &found[index];
            let passed = check_answer(world.airspace, request, &known, answer, None);
            assert!(passed.is_ok(), "{passed:?}");
        });
        alone.print(&format!("the check alone, {legs} legs"));
    }
}

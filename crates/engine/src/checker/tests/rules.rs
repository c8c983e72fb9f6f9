//! What is open, how long it is, what outcomes and flags say.

use super::*;

#[test]
fn what_holds_passes() {
    assert_eq!(Story::around().checked(), Ok(()));
    assert_eq!(Story::on().checked(), Ok(()));
    let bare = Story {
        told: Told::NoRoute,
        ids: "",
        ..Story::around()
    };
    assert_eq!(bare.checked(), Ok(()));
}

#[test]
fn lengths_add_up() {
    let mut short = Story::around();
    short.length_m = 1_200.0;
    assert_eq!(short.rule(), Rule::Length);
    short.length_m = f64::NAN;
    assert_eq!(short.rule(), Rule::Length);
}

#[test]
fn closed_nodes_and_segments_are_not_flown() {
    let close = |story: Story, nodes: &[&str], segments: &[&str]| {
        let topology = story.topology.clone();
        let nodes = nodes.iter().map(|id| node(&topology, id)).collect();
        let segments = segments
            .iter()
            .map(|ids| way(&topology, ids).1[0])
            .collect();
        let closure = Closure::of_operator("o".to_owned(), String::new(), nodes, segments);
        story.closing(&[Change::Put(Arc::new(closure))])
    };
    assert_eq!(
        close(Story::around(), &[], &["DE"]).rule(),
        Rule::ClosedSegment
    );
    assert_eq!(close(Story::around(), &["E"], &[]).rule(), Rule::ClosedNode);
    // Where it begins, too: it is not there yet.
    assert_eq!(close(Story::around(), &["A"], &[]).rule(), Rule::ClosedNode);
    let mut at_node = Story::around();
    at_node.at = Whereabouts::LegStart;
    at_node.stretch.kind = StretchKind::None;
    at_node.stretch.length_m = 0.0;
    at_node.length_m = 1_200.0;
    assert_eq!(close(at_node, &["A"], &[]).checked(), Ok(()));
}

#[test]
fn flags_have_their_ground() {
    for flag in Flag::ALL {
        let flagged = Story {
            flags: Flags::default().with(flag),
            ..Story::around()
        };
        assert_eq!(flagged.rule(), Rule::FlagWithoutGround(flag));
    }
}

#[test]
fn an_outcome_says_what_the_path_does() {
    let elsewhere = Story {
        destination: node(&world(), "E"),
        ..Story::around()
    };
    assert_eq!(elsewhere.rule(), Rule::Outcome);
    let story = Story::on();
    let planned = way(&story.topology, "ABEDA").0;
    let other_plan = Story {
        planned: Some(planned),
        ..story
    };
    assert_eq!(other_plan.rule(), Rule::Outcome);
    let diverted = Story {
        told: Told::Diverted,
        ..Story::around()
    };
    assert_eq!(diverted.rule(), Rule::Pad);
    let mut to_pad = Story {
        told: Told::Diverted,
        ids: "ADE",
        length_m: 800.0,
        ..Story::around()
    };
    assert_eq!(to_pad.checked(), Ok(()));
    to_pad.need = Need::Ground;
    assert_eq!(to_pad.checked(), Ok(()));
    let flies_on = Story {
        need: Need::Pad { shown: false },
        ..Story::on()
    };
    assert_eq!(flies_on.rule(), Rule::Outcome);
}

#[test]
fn a_drone_on_the_ground_in_a_zone_stays() {
    let topology = world();
    let pad = node(&topology, "B");
    let leg = (pad, node(&topology, "C"));
    let story = Story {
        leg,
        stands_at: Some(pad),
        at: Whereabouts::LegStart,
        ids: "BC",
        length_m: 500.0,
        closes_leg: false,
        stretch: Stretch {
            kind: StretchKind::None,
            leg: Some(leg),
            enters: pad,
            length_m: 0.0,
            overrun_m: 0.0,
        },
        topology: topology.clone(),
        airspace: open(&topology),
        ..Story::around()
    };
    assert_eq!(story.checked(), Ok(()));
    let mut zoned = story.closing(&[circle(&topology, 500.0, 0.0, 40.0)]);
    assert_eq!(zoned.rule(), Rule::SentUp);
    zoned.told = Told::Hold;
    zoned.ids = "B";
    zoned.length_m = 0.0;
    assert_eq!(zoned.checked(), Ok(()));
}

//! Whether a flown version keeps apart from what others take.

use super::terms::DroneKind;
use super::{Compiled, Flights};
use crate::planner::{Own, Scene, Version};
use std::sync::Arc;

impl Flights {
    /// Whether a flown version would come too near to what those plans take that count: on its segments, the way
    /// to its first node included, at its nodes, where segments cross it, or on a pad.
    pub(super) fn meets(
        &self,
        scene: Scene<'_>,
        own: Own<'_>,
        version: &Version,
        counts: &dyn Fn(&str) -> bool,
    ) -> bool {
        let traffic = scene.traffic;
        if traffic.shares_pad_with(own, version, counts).is_some() {
            return true;
        }
        let others = traffic.others(own, version.departs_at);
        let compiled = self.any_compiled(scene);
        let world = compiled.setting.world();
        version.flight.as_ref().is_some_and(|flown| {
            let plan = &flown.composition.plan;
            !world
                .separation()
                .met_by(plan, 0.0, &others, counts)
                .is_empty()
        })
    }

    /// Any kind of drone: how plans keep apart is the same for all.
    fn any_compiled(&self, scene: Scene<'_>) -> Arc<Compiled> {
        let topology = scene.topology();
        let found = {
            let kept = self.lock();
            let mut of_network = kept.compiled.iter();
            of_network
                .rfind(|compiled| Arc::ptr_eq(&compiled.topology, topology))
                .cloned()
        };
        let any = DroneKind::new(self.settings.airframe.clone(), 0.0);
        found.unwrap_or_else(|| self.compiled(scene, &any))
    }
}

//! The engine's words and those of the wire, one for one.

use crate::flight::{FailureType, OperationalDetail, StretchKind};
use crate::recompose::{Flag, Outcome, Scope, Stage, Strategy};
use crate::wire;

/// The word of the other vocabulary that means the same.
pub trait Counterpart<T> {
    /// Says it in the other vocabulary.
    fn counterpart(self) -> T;
}

/// Counterparts of two enumerations with the same variants.
macro_rules! same_words {
    ($from:ty => $to:ty { $($word:ident),+ $(,)? }) => {
        impl Counterpart<$to> for $from {
            fn counterpart(self) -> $to {
                match self {
                    $(Self::$word => <$to>::$word,)+
                }
            }
        }
    };
}

same_words!(wire::FailureType => FailureType {
    Environmental, Navigational, Regulatory, Infrastructure, Operational, ServiceLevel,
});
same_words!(FailureType => wire::FailureType {
    Environmental, Navigational, Regulatory, Infrastructure, Operational, ServiceLevel,
});
same_words!(wire::OperationalDetail => OperationalDetail { Battery, Payload, Propulsion, LandNow });
same_words!(OperationalDetail => wire::OperationalDetail { Battery, Payload, Propulsion, LandNow });
same_words!(wire::Strategy => Strategy {
    Exact, TwoPhased, CellDensity, Radius, Dijkstra, Astar, BellmanFord,
});
same_words!(Strategy => wire::Strategy {
    Exact, TwoPhased, CellDensity, Radius, Dijkstra, Astar, BellmanFord,
});
same_words!(wire::Scope => Scope { Local, Global });
same_words!(Scope => wire::Scope { Local, Global });
same_words!(Outcome => wire::Outcome { Rerouted, Unaffected, Hold, Diverted, NoRoute });
same_words!(Stage => wire::Stage {
    Global, Circle, Cells, Triangle, Rhombus, Rectangle, Grown, Local,
});
same_words!(StretchKind => wire::StretchKind { Leg, Straight, None });
same_words!(Flag => wire::Flag { LeavingZone, CannotStop, Unverified, ReserveUsed, PadOccupied });

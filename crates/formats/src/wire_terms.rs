//! The engine's words and those of the wire, one for one.

use crate::flight::{FailureType, OperationalDetail, StretchKind};
use crate::recompose::{Flag, Outcome, Scope, Stage, Strategy};
use crate::wire;

/// A conversion between the words of the engine and those of the wire.
pub trait IntoTerm<T> {
    /// The word that means the same on the other side.
    fn into_term(self) -> T;
}

/// Conversions between two enumerations with the same variants.
macro_rules! same_words {
    ($from:ty => $to:ty { $($word:ident),+ $(,)? }) => {
        impl IntoTerm<$to> for $from {
            fn into_term(self) -> $to {
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
same_words!(Flag => wire::Flag { LeavingZone, CannotStop, Unverified, ReserveUsed, PadOccupied, Unseparated });

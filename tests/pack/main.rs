//! Packs: what a drone reads when the line is gone, byte by byte, and the door to C.

mod bytes;
mod door;
mod drafts;
mod golden;
mod said;
mod walked;

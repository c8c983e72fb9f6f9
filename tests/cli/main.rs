//! The command line from outside: the real binary, its exit codes, what it writes and where.

mod answers;
mod binary;
mod help;
mod input;
mod networks;
mod requests;

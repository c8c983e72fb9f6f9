//! Any text as a network file: GeoJSON, node-link, GraphML, or two CSV tables; what is read is written as it was.

use skyway::formats::{
    draft_of, load_csv_network, load_network, read_network, write_graphml, write_network,
    write_node_link,
};

/// What stands between the table of nodes and that of segments.
const BETWEEN_TABLES: &str = "\n---\n";

/// Loads a network, and writes it in the formats that are text.
///
/// # Panics
/// When a network that can be read breaks a promise.
pub(crate) fn run(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let loaded = match text.split_once(BETWEEN_TABLES) {
        Some((nodes, segments)) => load_csv_network(nodes, segments),
        None => load_network(text),
    };
    let loaded = match loaded {
        Ok(loaded) => loaded,
        Err(error) => {
            assert!(!error.lines().is_empty(), "an error says what is wrong");
            return;
        }
    };
    let written = write_node_link(&loaded.topology);
    assert!(load_network(&written).is_ok(), "{written}");
    // An id that XML has no place for is refused.
    if let Ok(written) = write_graphml(&draft_of(&loaded.topology)) {
        assert!(load_network(&written.text).is_ok(), "{}", written.text);
    }
    if let Ok(draft) = read_network(text) {
        let written = write_network(&draft);
        let again = read_network(&written).expect("what is written is a network");
        assert_eq!(write_network(&again), written);
    }
}

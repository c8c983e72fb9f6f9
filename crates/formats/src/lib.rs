//! Files in and out: text to domain values, domain values to text. Nothing here opens a file.

mod answer;
mod area;
mod certificate;
mod composition;
mod criticality;
mod error;
mod feed;
mod flight_document;
mod flight_question;
mod flight_writer;
mod identifier;
mod mark;
mod networks;
mod place;
mod recorded_world;
mod report;
mod route;
mod safety;
mod suggestion;
mod twice;
mod weather;
mod wire_terms;
mod zones;

use skyway_contract as wire;
use skyway_engine::{
    airspace, compose, delivery, flight, geo, itinerary, network, recompose, routing, verify,
};

pub use answer::{answer, warning_text};
pub use area::area_geometry;
pub use certificate::write_certificate;
pub use composition::composition_json;
pub use criticality::{read_demand, write_criticality};
pub use error::{FormatError, MAX_FORMAT_ERRORS};
pub use feed::{
    ED318_MEDIA_TYPE, FeedFormat, FeedNote, FeedTerms, FeedZone, KML_MEDIA_TYPE, MAX_FEED_BYTES,
    MAX_FEED_ZONES, ZoneFeed, read_feed, write_ed318,
};
pub use flight_document::{
    DifferingPremise, FlightDocument, FlightDocumentFault, differing_premises, is_flight_document,
    premises_lines, read_flight_document, write_flight_document,
};
pub use flight_question::{
    FlightQuestion, ReadQuestion, read_flight_question, write_flight_question,
};
pub use flight_writer::{FlightWriter, flight_cause_text, stop_kind_name};
pub use identifier::{find_node, id_text, node_id, node_id_json, segment_id_json};
pub use mark::without_mark;
pub use networks::attributes::{AttributeKind, ReadNetwork, Unread};
pub use networks::buildings::read_buildings;
pub use networks::csv::read_csv_network;
pub use networks::foreign::ForeignFormat;
pub use networks::geojson::{patch_network, read_network, write_network};
pub use networks::geopackage::{
    Cell, GeopackageLayer, GeopackageNetwork, GeopackageStatement, NETWORK_TABLE, NODES_LAYER,
    SEGMENTS_LAYER, WrittenGeopackage, load_geopackage, write_geopackage,
};
pub use networks::graphml::{MAX_GRAPHML_BYTES, WrittenGraphml, read_graphml, write_graphml};
pub use networks::load::{
    LoadError, LoadedNetwork, fingerprint, is_foreign, load_csv_network, load_network,
};
pub use networks::node_link::{read_node_link, write_node_link};
pub use networks::osm::{DegreeBox, OSM_ATTRIBUTION, OsmBuildings, read_osm_buildings};
pub use networks::stated::draft_of;
pub use recorded_world::{RecordError, recorded_question};
pub use report::known::{CloseTarget, Known, KnownPlan, Unplaced};
pub use report::parse::{ParsedReport, lenient_report, parse_report, twice};
pub use report::problem::{ReadWarning, ReportProblem, bounded};
pub use report::resolve::{ResolvedReport, resolve_report};
pub use report::resolved::settled_report;
pub use report::{ReadReport, read_report};
pub use route::{Route, RouteFormat, RouteLeg, RouteProblem, WrittenRoute, write_route};
pub use safety::{first_stretch, unsafe_way, waypoint};
pub use suggestion::nearest;
pub use twice::members_twice;
pub use weather::wind_field;
pub use wire_terms::IntoTerm;
pub use zones::{
    MAX_ZONE_PROBLEMS, ZoneCode, ZoneId, ZoneProblem, is_path_step, miss_hint, read_zones,
    write_zones, zone_from_feature, zone_to_feature,
};

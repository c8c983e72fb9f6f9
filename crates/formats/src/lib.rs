//! Files in and out: text to domain values, domain values to text. Nothing here opens a file.

mod answer;
mod area;
mod attributes;
mod buildings;
mod certificate;
mod composition;
mod criticality;
mod csv_network;
mod error;
mod feed;
mod flight_document;
mod flight_question;
mod flight_writer;
mod foreign;
mod geopackage;
mod graphml;
mod identifier;
mod load;
mod mark;
mod network_geojson;
mod node_link;
mod osm;
mod place;
mod recorded_world;
mod report;
mod report_circumstances;
mod report_close;
mod report_known;
mod report_leg;
mod report_names;
mod report_nearest;
mod report_parse;
mod report_place;
mod report_problem;
mod report_resolve;
mod report_resolved;
#[cfg(test)]
mod round_trips;
mod route;
mod safety;
mod stated;
mod suggestion;
mod twice;
mod weather;
mod wire_terms;
mod zones;

use skyway_contract as wire;
use skyway_engine::{
    airspace, compose, delivery, flight, geo, itinerary, network, recompose, routing,
};

pub use answer::{answer, warning_text};
pub use area::area_geometry;
pub use attributes::{AttributeKind, ReadNetwork, Unread};
pub use buildings::read_buildings;
pub use certificate::write_certificate;
pub use composition::composition_json;
pub use criticality::{read_demand, write_criticality};
pub use csv_network::read_csv_network;
pub use error::{FormatError, MAX_FORMAT_ERRORS};
pub use feed::{
    FeedFormat, FeedNote, FeedTerms, FeedZone, KML_MEDIA_TYPE, MAX_FEED_BYTES, MAX_FEED_ZONES,
    ZoneFeed, read_feed, write_ed318,
};
pub use flight_document::{
    DifferingPremise, FlightDocument, FlightDocumentFault, differing_premises, is_flight_document,
    premises_lines, read_flight_document, write_flight_document,
};
pub use flight_question::{
    FlightQuestion, ReadQuestion, read_flight_question, write_flight_question,
};
pub use flight_writer::{FlightWriter, flight_cause_text, stop_kind_name};
pub use foreign::ForeignFormat;
pub use geopackage::{
    Cell, GeopackageLayer, GeopackageNetwork, GeopackageStatement, NETWORK_TABLE, NODES_LAYER,
    SEGMENTS_LAYER, WrittenGeopackage, load_geopackage, write_geopackage,
};
pub use graphml::{MAX_GRAPHML_BYTES, WrittenGraphml, read_graphml, write_graphml};
pub use identifier::{find_node, id_text, node_id, node_id_json, segment_id_json};
pub use load::{LoadError, LoadedNetwork, fingerprint, is_foreign, load_csv_network, load_network};
pub use mark::without_mark;
pub use network_geojson::{patch_network, read_network, write_network};
pub use node_link::{read_node_link, write_node_link};
pub use osm::{DegreeBox, OSM_ATTRIBUTION, OsmBuildings, read_osm_buildings};
pub use recorded_world::{RecordError, recorded_question};
pub use report::{ReadReport, read_report};
pub use report_known::{CloseTarget, Known, KnownPlan, Unplaced};
pub use report_parse::{ParsedReport, lenient_report, parse_report, twice};
pub use report_problem::{ReadWarning, ReportProblem, bounded};
pub use report_resolve::{ResolvedReport, resolve_report};
pub use report_resolved::settled_report;
pub use route::{Route, RouteFormat, RouteLeg, RouteProblem, WrittenRoute, write_route};
pub use safety::{first_stretch, unsafe_way, waypoint};
pub use stated::draft_of;
pub use suggestion::nearest;
pub use twice::members_twice;
pub use weather::wind_field;
pub use wire_terms::IntoTerm;
pub use zones::{
    MAX_ZONE_PROBLEMS, ZoneCode, ZoneId, ZoneProblem, miss_hint, read_zones, write_zones,
    zone_from_feature, zone_to_feature,
};

//! Who wins, what is refused and how, what the sample says, and with what an edge may start.

use super::*;
use std::collections::BTreeSet;
use std::time::Duration;

fn flag(name: &str, value: &str) -> Flag {
    Flag {
        flag: format!("--set {name}"),
        name: name.to_owned(),
        value: value.to_owned(),
    }
}

fn sources(file: &str, environment: &[(&str, &str)], flags: &[(&str, &str)]) -> Sources {
    let variables = environment.iter();
    let flags = flags.iter();
    Sources {
        file: Some(("edge.toml".to_owned(), file.to_owned())),
        environment: variables
            .map(|(name, value)| ((*name).to_owned(), (*value).to_owned()))
            .collect(),
        flags: flags.map(|(name, value)| flag(name, value)).collect(),
    }
}

fn effective(
    file: &str,
    environment: &[(&str, &str)],
    flags: &[(&str, &str)],
) -> EffectiveConfig<EdgeConfig> {
    resolve(&sources(file, environment, flags)).expect("a valid configuration")
}

/// The messages, one to a line.
fn faults(file: &str, environment: &[(&str, &str)], flags: &[(&str, &str)]) -> String {
    let faults = resolve::<EdgeConfig>(&sources(file, environment, flags)).expect_err("faults");
    lines(&faults)
}

fn lines(faults: &[ConfigFault]) -> String {
    let lines: Vec<String> = faults.iter().map(ToString::to_string).collect();
    lines.join("\n")
}

#[test]
fn a_flag_wins_over_the_environment_that_over_the_file_that_over_the_default() {
    let file = "[limits]\nbatch = 1\nconnections = 1\nbody = \"2MiB\"\n";
    let environment = [
        ("SKYWAY_EDGE_LIMITS_BATCH", "2"),
        ("SKYWAY_EDGE_LIMITS_CONNECTIONS", "2"),
        ("PATH", "/bin"),
        ("SKYWAY_EDGES", "3"),
    ];
    let effective = effective(file, &environment, &[("limits.batch", "3")]);
    let limits = &effective.config.limits;
    assert_eq!((limits.batch, limits.connections), (3, 2));
    assert_eq!(limits.body, Size::of_mib(2));
    assert_eq!(limits.header, Limits::default().header);
    let origin = |name: &str| effective.origin(name).to_string();
    assert_eq!(origin("limits.batch"), "flag --set limits.batch");
    assert_eq!(
        origin("limits.connections"),
        "env SKYWAY_EDGE_LIMITS_CONNECTIONS"
    );
    assert_eq!(origin("limits.body"), "file edge.toml:4");
    assert_eq!(origin("limits.header"), "default");
}

#[test]
fn every_setting_can_be_said_in_every_way_and_comes_back_as_it_was_said() {
    let defaults = EdgeConfig::default();
    for setting in SETTINGS {
        let (name, text) = (setting.name(), (setting.text)(&defaults));
        let variable = setting.variable();
        let said = effective("", &[(&variable, &text)], &[]);
        assert_eq!(said.config, defaults, "{name}");
        assert_eq!(said.origin(&name), Origin::Environment { variable });
        let said = effective("", &[], &[(&name, &text)]);
        assert_eq!(said.config, defaults, "{name}");
        if let Some((least, most)) = (setting.bounds)() {
            effective("", &[], &[(&name, &least)]);
            effective("", &[], &[(&name, &most)]);
        }
    }
    let variables: BTreeSet<String> = SETTINGS.iter().map(Setting::variable).collect();
    assert_eq!(
        variables.len(),
        SETTINGS.len(),
        "two settings, one variable"
    );
}

#[test]
fn what_is_shown_is_a_file_that_says_the_same() {
    let first = effective(
        "listen = \"[::1]:0\"\ntokens_file = 'a\"b'\n[log]\nfilter = \"warn,skyway::api=debug\"\n",
        &[("SKYWAY_EDGE_CLOCK_START", "2026-05-04T08:00:00Z")],
        &[
            ("limits.preface_deadline", "1500ms"),
            ("airspace.margin_m", "2.5"),
        ],
    );
    for with_origin in [false, true] {
        let second = effective(&first.to_toml(with_origin), &[], &[]);
        assert_eq!(second.config, first.config);
    }
    let json = first.to_json(false);
    assert_eq!(json["limits"]["preface_deadline"], "1500ms");
    assert_eq!(json["limits"]["batch"], 1000);
    assert_eq!(json["airspace"]["margin_m"], 2.5);
    assert_eq!(json["allow_plaintext"], false);
    let origins = first.to_json(true);
    assert_eq!(origins["listen"]["origin"], "file edge.toml:1");
    assert_eq!(origins["listen"]["value"], "[::1]:0");
}

#[test]
fn the_sample_says_the_defaults_and_all_of_them() {
    let is_setting = |line: &&str| line.starts_with('#') && !line.starts_with("# ");
    let text = sample::<EdgeConfig>();
    let uncommented: Vec<&str> = text
        .lines()
        .filter(|line| *line != "#")
        .map(|line| if is_setting(&line) { &line[1..] } else { line })
        .collect();
    let said = effective(&uncommented.join("\n"), &[], &[]);
    assert_eq!(said.config, EdgeConfig::default());
    for setting in SETTINGS {
        let name = setting.name();
        assert!(
            matches!(said.origin(&name), Origin::File { .. }),
            "{name} is missing"
        );
    }
    assert_eq!(effective(&text, &[], &[]).config, EdgeConfig::default());
    let committed = include_str!("../../../../deploy/edge.toml");
    assert_eq!(
        committed, text,
        "write it again: skyway config sample > deploy/edge.toml"
    );
}

#[test]
fn a_registry_has_settings_variables_and_a_sample_of_its_own() {
    let sources = Sources {
        file: Some(("registry.toml".to_owned(), sample::<RegistryConfig>())),
        environment: vec![
            ("SKYWAY_REGISTRY_CHANGES_KEEP".to_owned(), "7".to_owned()),
            ("SKYWAY_EDGE_LIMITS_BATCH".to_owned(), "nonsense".to_owned()),
        ],
        flags: vec![flag("store", "postgres://localhost/skyway")],
    };
    let said: EffectiveConfig<RegistryConfig> = resolve(&sources).expect("a valid configuration");
    assert_eq!(said.config.changes.keep, 7);
    assert_eq!(said.config.store, "postgres://localhost/skyway");
    assert_eq!(said.config.listen, RegistryConfig::default().listen);
    said.admit().expect("it starts");
    let committed = include_str!("../../../../deploy/registry.toml");
    assert_eq!(
        committed,
        sample::<RegistryConfig>(),
        "write it again: skyway config sample --registry > deploy/registry.toml"
    );
    let exposed = Sources {
        flags: vec![flag("listen", "0.0.0.0:8180"), flag("network", "sydney")],
        ..Sources::default()
    };
    let told = resolve::<RegistryConfig>(&exposed).expect_err("an unknown setting");
    assert_eq!(
        lines(&told),
        "flag --set network: there is no setting 'network'; did you mean limits.network?"
    );
    let exposed = Sources {
        flags: vec![flag("listen", "0.0.0.0:8180")],
        ..Sources::default()
    };
    let exposed: EffectiveConfig<RegistryConfig> = resolve(&exposed).expect("it can be read");
    assert_eq!(exposed.admit().expect_err("it is exposed").len(), 2);
}

#[test]
fn what_is_wrong_in_a_file_is_told_all_at_once_with_its_line() {
    let file = "\
lisen = \"127.0.0.1:1\"
connections = 5
listen = 8080
allow_plaintext = \"yes\"
log = \"debug\"
network = { file = \"x\" }
[limit]
batch = 1
[limits]
connectons = 5
batch = \"1000\"
body = 1048576
header = \"16 KB\"
listen = \"127.0.0.1:1\"
streams_per_connection = 0x0
in_flight_reads = 99999999999999999999999999
request_deadline = \"2 fortnights\"
event_streams = -1
[reports]
closed_fraction_max = 87
[airspace]
margin_m = nan
[clock]
start = 2026-05-04T08:00:00Z
";
    let told = faults(file, &[], &[]);
    insta::assert_snapshot!(told, @r"
    file edge.toml:1: there is no setting 'lisen'; did you mean listen?
    file edge.toml:2: there is no setting 'connections'; did you mean limits.connections?
    file edge.toml:3: listen is a number, not text in quotes: an address and port such as 127.0.0.1:8080 or [::1]:8080
    file edge.toml:4: allow_plaintext is text, not true or false
    file edge.toml:5: log is text, not a section of the file
    file edge.toml:6: network is a section, not text in quotes: a name or path of at least one character
    file edge.toml:7: there is no setting 'limit'; did you mean limits?
    file edge.toml:10: there is no setting 'limits.connectons'; did you mean limits.connections?
    file edge.toml:11: limits.batch is text, not a whole number
    file edge.toml:12: limits.body is a number, not text in quotes: a size such as 512B, 16KiB, 1MiB or 1GiB
    file edge.toml:13: limits.header: '16 KB' is not a size such as 512B, 16KiB, 1MiB or 1GiB
    file edge.toml:14: there is no setting 'limits.listen'; did you mean listen?
    file edge.toml:15: limits.streams_per_connection: 0 is not from 1 to 10000
    file edge.toml:16: limits.in_flight_reads: '99999999999999999999999999' is not a whole number such as 1000
    file edge.toml:17: limits.request_deadline: '2 fortnights' is not a duration such as 500ms, 30s, 5min or 24h
    file edge.toml:18: limits.event_streams: '-1' is not a whole number such as 1000
    file edge.toml:20: reports.closed_fraction_max: 87 is not from 0 to 1
    file edge.toml:22: airspace.margin_m: 'nan' is not a number such as 0.5
    file edge.toml:24: clock.start is a date, not text in quotes: an RFC 3339 time such as 2026-05-04T08:00:00Z, or empty for none
    ");
}

#[test]
fn what_is_no_toml_is_told_with_its_line() {
    let files = [
        "listen = \n",
        "[limits]\nbatch = 1\nbatch = 2\n",
        "[limits\n",
        "listen = 127.0.0.1:8080\n",
        "\u{0}",
    ];
    let told = files.map(|file| faults(file, &[], &[]));
    insta::assert_snapshot!(told.join("\n"), @r"
    file edge.toml:1: string values must be quoted, expected literal string
    file edge.toml:3: duplicate key
    file edge.toml:1: unclosed table, expected `]`
    file edge.toml:1: invalid float, expected nothing
    file edge.toml:1: key with no value, expected `=`
    file edge.toml:1: invalid unquoted key, expected letters, numbers, `-`, `_`
    ");
}

#[test]
fn what_is_wrong_in_the_environment_and_in_flags_is_told_all_at_once() {
    let environment = [
        ("SKYWAY_EDGE_LISTENS", "127.0.0.1:1"),
        ("SKYWAY_EDGE_LIMITS_BODY", "1MB"),
        ("SKYWAY_EDGE_", ""),
        ("SKYWAY_EDGE_LOG_FILTER", "inof"),
        ("SKYWAY_EDGE_NETWORK", " "),
    ];
    let flags = [
        ("limits.bodi", "1MiB"),
        ("body", "1MiB"),
        ("drain.timeout", "2h"),
        ("drain.delay", "-5s"),
        ("plans.headway", "1s"),
        ("plans.headway", "2s"),
        ("log.format", "xml"),
        ("clock.rate", "inf"),
        ("log.filter", "=debug"),
    ];
    insta::assert_snapshot!(faults("", &environment, &flags), @r"
    env SKYWAY_EDGE_LISTENS: there is no setting 'SKYWAY_EDGE_LISTENS'; did you mean SKYWAY_EDGE_LISTEN?
    env SKYWAY_EDGE_LIMITS_BODY: limits.body: '1MB' is not a size such as 512B, 16KiB, 1MiB or 1GiB
    env SKYWAY_EDGE_: there is no setting 'SKYWAY_EDGE_'
    env SKYWAY_EDGE_LOG_FILTER: log.filter: 'inof' is not a log filter: off, error, warn, info, debug or trace, and for a module MODULE=LEVEL, as in info,skyway::api=debug
    env SKYWAY_EDGE_NETWORK: network: ' ' is not a name or path of at least one character
    flag --set limits.bodi: there is no setting 'limits.bodi'; did you mean limits.body?
    flag --set body: there is no setting 'body'; did you mean limits.body?
    flag --set drain.timeout: 2h is not from 0s to 1h
    flag --set drain.delay: '-5s' is not a duration such as 500ms, 30s, 5min or 24h
    flag --set plans.headway is set twice; keep one of the flags
    flag --set log.format: 'xml' is not text or json
    flag --set clock.rate: 'inf' is not a number such as 0.5
    flag --set log.filter: '=debug' is not a log filter: off, error, warn, info, debug or trace, and for a module MODULE=LEVEL, as in info,skyway::api=debug
    ");
}

#[test]
fn values_are_read_as_people_write_them() {
    let said = |name: &str, value: &str| effective("", &[], &[(name, value)]).config;
    let age = |text: &str| said("idempotency.age", text).idempotency.age;
    assert_eq!(age("90min"), Duration::from_mins(90));
    assert_eq!(age("1h 30m"), Duration::from_mins(90));
    assert_eq!(age("5400s"), Duration::from_mins(90));
    let body = |text: &str| said("limits.body", text).limits.body.bytes();
    assert_eq!(body("1024B"), 1024);
    assert_eq!(body("2 MiB"), 2 << 20);
    let shown = |name: &str, value: &str| {
        let config = said(name, value);
        let setting = SETTINGS.iter().find(|row| row.name() == name);
        setting.map(|row| (row.text)(&config))
    };
    assert_eq!(shown("idempotency.age", "5400s").as_deref(), Some("90min"));
    assert_eq!(shown("limits.body", "1536KiB").as_deref(), Some("1536KiB"));
    assert_eq!(shown("drain.delay", "0min").as_deref(), Some("0s"));
    assert_eq!(shown("records.bytes", "0MiB").as_deref(), Some("0B"));
    assert!(said("tokens_file", "").tokens_file.is_none());
}

/// What is said of an edge that wants to start, row by row.
const STARTS: &[&str] = &[
    "",
    "listen=127.9.9.9:80 admin_listen=[::1]:9",
    "listen=[::ffff:127.0.0.1]:80",
    "clock.rate=20",
    "listen=0.0.0.0:8080",
    "listen=192.168.1.4:8080 allow_plaintext=true",
    "listen=[::]:8080 tokens_file=/nowhere/tokens.toml",
    "admin_listen=0.0.0.0:9090",
    "admin_listen=[::]:9090",
    "admin_listen=203.0.113.4:9090",
    "admin_listen=10.0.0.4:9090",
    "listen=127.0.0.1:9090",
    "listen=10.0.0.4:80 clock.start=2026-05-04T08:00:00Z clock.rate=2",
    "admin_listen=10.0.0.4:80 clock.rate=2",
    "freshness.degraded_after=30s",
    "listen=127.0.0.1:0 admin_listen=127.0.0.1:0",
    "registry.url=http://localhost:8180",
    "registry.url=http://registry.example",
    "registry.url=http://registry.example registry.allow_plaintext=true",
    "registry.url=https://registry.example",
    "registry.url=https://[2001:db8::1]:8443/skyway",
    "registry.url=https://",
    "registry.url=ftp://registry.example",
    "registry.url=https://registry.example registry.advertise=10.0.0.7:8080",
    "registry.url=https://registry.example registry.ca_file=/nowhere/ca.pem",
    "registry.url=https://registry.example registry.ca_file=Cargo.toml",
];

/// What is wrong with what is to fly; empty where nothing is.
fn flight(file: &str) -> String {
    let told = match resolve::<EdgeConfig>(&sources(file, &[], &[])) {
        Err(faults) => lines(&faults),
        Ok(effective) => effective
            .admit()
            .err()
            .map_or_else(String::new, |faults| lines(&faults)),
    };
    told.lines()
        .map(|line| line.trim_start_matches("file edge.toml:").to_owned())
        .collect::<Vec<_>>()
        .join("\n")
}

#[test]
fn what_flies_is_named_once_and_can_be_read() {
    let root = env!("CARGO_MANIFEST_DIR");
    let m100 = format!("{root}/../../data/airframes/m100.json");
    let good = format!("[flight]\nairframe = \"phantom3\"\nairframes = \" {m100},\"\n");
    assert_eq!(
        flight(&good).lines().next(),
        Some(&*format!(
            "3: flight.airframes: ' {m100},' is not names with commas between them, or empty for none"
        ))
    );
    assert_eq!(flight(&good.replace(",\"", "\"")), "");
    let said = effective(&good.replace(",\"", "\""), &[], &[]);
    assert_eq!(
        said.config.flight.airframes.iter().collect::<Vec<_>>(),
        [m100]
    );
    insta::assert_snapshot!(flight("[flight]\nairframe = \"phantom4\"\n"), @"2: flight.airframe: cannot read the airframe phantom4: No such file or directory (os error 2); name phantom3, m100, a file as in data/airframes, or none");
    insta::assert_snapshot!(flight("[flight]\nairframe = \"Cargo.toml\"\n"), @"2: flight.airframe: Cargo.toml: the airframe cannot be read: expected value at line 1 column 2; see data/airframes for examples");
    insta::assert_snapshot!(flight("[flight]\nairframes = \"m100, m100\"\n"), @"2: two airframes have the name 'DJI Matrice 100'; name each once");
    insta::assert_snapshot!(flight("[flight]\nairframe = \"none\"\nairframes = \"m100\"\n"), @"3: flight.airframes names airframes, and flight.airframe none; name the one that flies where a request names none");
    let named = |text: &str| {
        let flight = effective(text, &[], &[]).config.flight;
        flight.default_airframe().map(str::to_owned)
    };
    assert_eq!(named("[flight]\n").as_deref(), Some("phantom3"));
    assert_eq!(
        named("[flight]\nairframe = \"m100\"\n").as_deref(),
        Some("m100")
    );
    assert_eq!(named("[flight]\nairframe = \"none\"\n"), None);
    insta::assert_snapshot!(
        flight("[flight]\nfloor_fraction = 0.3\nobjective = \"speed\"\nreserve_fraction = 20\nairframe = 3\n"),
        @r"
    3: flight.objective: 'speed' is not distance, time or energy
    4: flight.reserve_fraction: 20 is not from 0 to 0.9
    5: flight.airframe is a number, not text in quotes: a text, or empty for none
    "
    );
    insta::assert_snapshot!(flight("[flight]\nfloor_fraction = 0.3\n"), @"2: flight.floor_fraction is more than flight.reserve_fraction, which it is the rest of");
}

/// Whether an edge of which this is said starts, with which warnings, or why not.
fn start(row: &str) -> String {
    let pairs = row
        .split_whitespace()
        .filter_map(|pair| pair.split_once('='));
    let said: Vec<(&str, &str)> = pairs.collect();
    match effective("", &[], &said).admit() {
        Err(faults) => lines(&faults),
        Ok(admission) if admission.warnings.is_empty() => "starts".to_owned(),
        Ok(admission) => {
            let warnings = admission.warnings.iter();
            let warnings: Vec<String> = warnings.map(|text| format!("warning: {text}")).collect();
            warnings.join("\n")
        }
    }
}

#[test]
fn an_edge_starts_only_where_nothing_is_exposed() {
    let rows = STARTS.iter().map(|row| format!("[{row}]\n{}", start(row)));
    let table: Vec<String> = rows.collect();
    insta::assert_snapshot!(table.join("\n"), @r"
    []
    starts
    [listen=127.9.9.9:80 admin_listen=[::1]:9]
    starts
    [listen=[::ffff:127.0.0.1]:80]
    starts
    [clock.rate=20]
    warning: the clock is simulated: every answer says so, and windows of zones open and close by it
    [listen=0.0.0.0:8080]
    flag --set listen: listen = 0.0.0.0:8080 is not loopback and there are no tokens; set tokens_file, or listen on 127.0.0.1
    flag --set listen: listen = 0.0.0.0:8080 is not loopback and the edge does not encrypt; put a proxy that does in front of it on loopback, or set allow_plaintext = true where the network is trusted
    [listen=192.168.1.4:8080 allow_plaintext=true]
    flag --set listen: listen = 192.168.1.4:8080 is not loopback and there are no tokens; set tokens_file, or listen on 127.0.0.1
    [listen=[::]:8080 tokens_file=/nowhere/tokens.toml]
    flag --set listen: listen = [::]:8080 is not loopback and the edge does not encrypt; put a proxy that does in front of it on loopback, or set allow_plaintext = true where the network is trusted
    flag --set tokens_file: cannot read /nowhere/tokens.toml: No such file or directory (os error 2)
    [admin_listen=0.0.0.0:9090]
    flag --set admin_listen: admin_listen = 0.0.0.0:9090 is neither loopback nor a private address; name the private address
    [admin_listen=[::]:9090]
    flag --set admin_listen: admin_listen = [::]:9090 is neither loopback nor a private address; name the private address
    [admin_listen=203.0.113.4:9090]
    flag --set admin_listen: admin_listen = 203.0.113.4:9090 is neither loopback nor a private address; name the private address
    [admin_listen=10.0.0.4:9090]
    flag --set admin_listen: admin_listen = 10.0.0.4:9090 is not loopback and there are no tokens; set tokens_file, or listen on 127.0.0.1
    [listen=127.0.0.1:9090]
    default: admin_listen = 127.0.0.1:9090 is also where drones are served; take another port
    [listen=10.0.0.4:80 clock.start=2026-05-04T08:00:00Z clock.rate=2]
    flag --set listen: listen = 10.0.0.4:80 is not loopback and there are no tokens; set tokens_file, or listen on 127.0.0.1
    flag --set listen: listen = 10.0.0.4:80 is not loopback and the edge does not encrypt; put a proxy that does in front of it on loopback, or set allow_plaintext = true where the network is trusted
    flag --set clock.start: a simulated clock is for loopback only, and listen = 10.0.0.4:80 is not; leave clock.start and clock.rate out
    [admin_listen=10.0.0.4:80 clock.rate=2]
    flag --set admin_listen: admin_listen = 10.0.0.4:80 is not loopback and there are no tokens; set tokens_file, or listen on 127.0.0.1
    flag --set clock.rate: a simulated clock is for loopback only, and admin_listen = 10.0.0.4:80 is not; leave clock.start and clock.rate out
    [freshness.degraded_after=30s]
    flag --set freshness.degraded_after is not longer than freshness.stale_after
    [listen=127.0.0.1:0 admin_listen=127.0.0.1:0]
    starts
    [registry.url=http://localhost:8180]
    starts
    [registry.url=http://registry.example]
    flag --set registry.url: registry.example may be another machine, and http does not encrypt; write https, or set registry.allow_plaintext = true where the network is trusted
    [registry.url=http://registry.example registry.allow_plaintext=true]
    starts
    [registry.url=https://registry.example]
    starts
    [registry.url=https://[2001:db8::1]:8443/skyway]
    starts
    [registry.url=https://]
    flag --set registry.url: registry.url = 'https://' is not one such as http://127.0.0.1:8180 or https://registry.example
    [registry.url=ftp://registry.example]
    flag --set registry.url: registry.url = 'ftp://registry.example' is not one such as http://127.0.0.1:8180 or https://registry.example
    [registry.url=https://registry.example registry.advertise=10.0.0.7:8080]
    flag --set registry.advertise: registry.advertise = '10.0.0.7:8080' is not one such as http://127.0.0.1:8180 or https://registry.example
    [registry.url=https://registry.example registry.ca_file=/nowhere/ca.pem]
    flag --set registry.ca_file: cannot read /nowhere/ca.pem: No such file or directory (os error 2)
    [registry.url=https://registry.example registry.ca_file=Cargo.toml]
    flag --set registry.ca_file: Cargo.toml: it has no certificate; it should have certificates that begin with -----BEGIN CERTIFICATE-----
    ");
}

#[test]
fn the_clock_is_simulated_only_when_asked_for() {
    let kind = |said: &[(&str, &str)]| {
        effective("", &[], said)
            .config
            .exposure()
            .start_clock()
            .kind()
    };
    use crate::wire::ClockKind;
    assert_eq!(kind(&[]), ClockKind::Real);
    assert_eq!(kind(&[("clock.rate", "1")]), ClockKind::Real);
    assert_eq!(kind(&[("clock.rate", "2")]), ClockKind::Simulated);
    assert_eq!(
        kind(&[("clock.start", "2026-05-04T08:00:00Z")]),
        ClockKind::Simulated
    );
}

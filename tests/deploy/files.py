"""The files of deploy/ as far as their own text says whether they are right. What their own programs check, scripts/check-deploy has checked."""

import json
import pathlib
import re
import subprocess
import tempfile

import jsonschema
import yaml

from machine import DEPLOY, ROOT, expect, run

# From the compose-spec project (Apache-2.0), as dclint 3.1.0 ships it.
COMPOSE_SCHEMA = pathlib.Path(__file__).with_name("compose-spec.json")


def compose() -> str:
    """deploy/compose.yaml is one by the schema, and names only what it declares."""
    file = yaml.safe_load((DEPLOY / "compose.yaml").read_text())
    jsonschema.Draft7Validator(json.loads(COMPOSE_SCHEMA.read_text())).validate(file)
    for name, service in file["services"].items():
        for kind in ("secrets", "configs", "networks"):
            used = service.get(kind, [])
            named = {entry["source"] if isinstance(entry, dict) else entry for entry in used}
            expect(named <= file[kind].keys(), f"compose.yaml: {name} uses {kind} that are not declared: {named - file[kind].keys()}")
        for volume in service.get("volumes", []):
            source = volume.split(":")[0]
            is_there = (DEPLOY / source).exists() if source.startswith("./") else source in file["volumes"]
            expect(is_there, f"compose.yaml: {name} mounts {source}, which is not there")
        expect(not service.get("depends_on") or set(service["depends_on"]) <= file["services"].keys(), f"compose.yaml: {name} depends on a stranger")
    for config in file["configs"].values():
        expect((DEPLOY / config["file"]).exists(), f"compose.yaml: {config['file']} is not there")
    return f"compose.yaml: {len(file['services'])} services, by the schema"


def kubernetes(haproxy: str, program: pathlib.Path, folder: pathlib.Path) -> str:
    """The manifests fit together; the proxies' configurations and the daemons' settings are taken by their programs."""
    certificate = folder / "proxy.pem"
    key = folder / "proxy.key"
    run("openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=proxy", "-keyout", key, "-out", certificate)
    certificate.write_text(certificate.read_text() + key.read_text())
    found = [part for path in sorted((DEPLOY / "kubernetes").glob("*.yaml")) for part in yaml.safe_load_all(path.read_text())]
    maps = {part["metadata"]["name"] for part in found if part["kind"] == "ConfigMap"}
    for part in found:
        if part["kind"] == "ConfigMap":
            text = part["data"]["haproxy.cfg"].replace("/run/certificate/proxy.pem", str(certificate))
            with tempfile.NamedTemporaryFile("w", suffix=".cfg") as file:
                file.write(text)
                file.flush()
                run(haproxy, "-c", "-q", "-f", file.name)
        if part["kind"] not in ("StatefulSet", "Deployment"):
            continue
        spec, template = part["spec"], part["spec"]["template"]
        expect(spec["selector"]["matchLabels"] == template["metadata"]["labels"], f"{part['metadata']['name']} does not select its pods")
        pod = template["spec"]
        expect(pod["enableServiceLinks"] is False, "with service links the daemon is given variables that are no settings")
        volumes = {volume["name"] for volume in pod["volumes"]} | {claim["metadata"]["name"] for claim in spec.get("volumeClaimTemplates", [])}
        for container in pod["initContainers"] + pod["containers"]:
            mounted = {mount["name"] for mount in container["volumeMounts"]}
            expect(mounted <= volumes, f"{container['name']} mounts {mounted - volumes}, which its pod has not")
        for volume in pod["volumes"]:
            name = volume.get("configMap", {}).get("name")
            expect(name in maps | {None, "skyway-authority"}, f"there is no ConfigMap {name}")
        daemon = pod["containers"][0]
        drain_s = next(int(entry["value"].removesuffix("s")) for entry in daemon["env"] if entry["name"].endswith("_DRAIN_DELAY"))
        # drain.timeout is 10 s by default.
        expect(pod["terminationGracePeriodSeconds"] > drain_s + 10, "the pod is killed while the daemon drains")
        settings(program, daemon["args"][0], {entry["name"]: entry.get("value", "skyway-edge-0") for entry in daemon["env"]}, folder)
    return f"kubernetes: {len(found)} objects that fit together"


def settings(program: pathlib.Path, role: str, environment: dict[str, str], volume: pathlib.Path) -> None:
    """The daemon knows all settings of an environment; its volume is here a folder, and other files are not looked for."""
    here = {name: value for name, value in environment.items() if name.startswith("SKYWAY_") and not name.endswith("_FILE")}
    for name in here:
        if name.endswith("_STORE"):
            here[name] = here[name].replace("/var/lib/skyway", str(volume))
    command = [str(program), "config", "check", *(["--registry"] if role == "registry" else [])]
    done = subprocess.run(command, env=here, capture_output=True, text=True, check=False, cwd="/")
    expect(done.returncode == 0, f"{role}, {environment}: {done.stderr}")


def prometheus_in_a_cluster(promtool: pathlib.Path) -> str:
    """prometheus/kubernetes.yml, with addresses in place of the search for pods, which Debian's promtool does not know."""
    file = yaml.safe_load((DEPLOY / "prometheus/kubernetes.yml").read_text())
    for job in file["scrape_configs"]:
        expect(job.pop("kubernetes_sd_configs")[0]["role"] == "pod", "it does not look for pods")
        job["static_configs"] = [{"targets": ["localhost:9443"]}]
    with tempfile.NamedTemporaryFile("w", suffix=".yml", dir=DEPLOY / "prometheus") as changed:
        yaml.safe_dump(file, changed)
        changed.flush()
        run(promtool, "check", "config", "--syntax-only", changed.name)
    return "prometheus/kubernetes.yml: but for the search for pods, a configuration"


def alerts() -> str:
    """Each alert has a case in which it fires, and a line in docs/operations.md."""
    groups = yaml.safe_load((DEPLOY / "prometheus/alerts.yml").read_text())["groups"]
    cases = yaml.safe_load((DEPLOY / "prometheus/alerts_test.yml").read_text())["tests"]
    names = {rule["alert"] for group in groups for rule in group["rules"] if "alert" in rule}
    fired = {case["alertname"] for test in cases for case in test["alert_rule_test"] if case["exp_alerts"]}
    expect(fired == names, f"alerts without a case in which they fire: {names - fired}")
    page = (ROOT / "docs/operations.md").read_text()
    missing = {name for name in names if f"`{name}`" not in page}
    expect(not missing, f"docs/operations.md does not say what these mean: {sorted(missing)}")
    return f"{len(names)} alerts, each with a case in which it fires and a word on what to do"


def image_context() -> str:
    """What the image is built from is enough for cargo: with empty packages, and with the sources."""
    ignored = [line for line in (ROOT / ".dockerignore").read_text().splitlines() if line and not line.startswith("#")]
    expect(ignored[0] == "*" and all(line.startswith("!") for line in ignored[1:]), ".dockerignore is not a list of what is taken")
    taken = [line[1:] for line in ignored[1:] if (ROOT / line[1:]).exists()]
    stage = re.search(r"AS manifests\n.*?RUN (.*?)\n\n", (DEPLOY / "Dockerfile").read_text(), re.DOTALL)
    with tempfile.TemporaryDirectory() as folder:
        run("cp", "--recursive", *(ROOT / name for name in taken), folder)
        metadata(folder)
        includes(pathlib.Path(folder))
        subprocess.run(["bash", "-euo", "pipefail", "-c", stage[1]], cwd=folder, check=True)
        metadata(folder)
        left = {path.name for path in pathlib.Path(folder).rglob("*") if path.is_file()}
        expect(left == {"Cargo.toml", "Cargo.lock", "build.rs", "lib.rs", "main.rs"}, f"the layer of dependencies would change with {left}")
    return "the image's context: enough for cargo, and its layer of dependencies hangs on the manifests alone"


def includes(folder: pathlib.Path) -> None:
    """What the sources take in while they are compiled is there."""
    expect(any((folder / "proto").rglob("*.proto")), "the image's context has no proto files, which build.rs compiles")
    for source in [*folder.glob("src/**/*.rs"), *folder.glob("crates/*/src/**/*.rs")]:
        for path in re.findall(r'include_(?:str|bytes)!\("([^"]+)"\)', source.read_text()):
            # Tests are not compiled into the image.
            is_there = source.name == "tests.rs" or (source.parent / path).exists()
            expect(is_there, f"the image's context lacks {path}, which {source.relative_to(folder)} includes")


def metadata(folder: str) -> None:
    """Cargo takes the folder for a package with the program."""
    told = json.loads(run("cargo", "metadata", "--locked", "--offline", "--no-deps", "--format-version", "1", cwd=folder).stdout)
    targets = [target["name"] for package in told["packages"] if package["name"] == "skyway" for target in package["targets"]]
    expect("skyway" in targets, "there is no program to build")

"""What of deploy/ runs, tried on a machine without a container engine. `scripts/check-deploy` calls it.

    run.py --program FILE --package FILE --tools FOLDER
    run.py ... --restarts 20        a longer rolling restart
    run.py ... --only units         one story alone
"""

import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import traceback

import backups
import exemplars
import files
import installation
import metrics
import one_image
import rolling_restart
import sizing
import units
import upgrade
from machine import Failed, make_network, run


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--program", type=pathlib.Path, required=True)
    arguments.add_argument("--package", type=pathlib.Path, required=True)
    arguments.add_argument("--tools", type=pathlib.Path, required=True, help="the folder with promtool and prometheus")
    arguments.add_argument("--restarts", type=int, default=5)
    arguments.add_argument("--only", help="the name of a story")
    given = arguments.parse_args()
    make_network()
    failed = 0
    with tempfile.TemporaryDirectory(prefix="skyway-deploy-") as name:
        folder = pathlib.Path(name)
        # Users of containers and of PostgreSQL go through it.
        folder.chmod(0o711)
        for story, tell in stories(folder, given).items():
            if given.only not in (None, story):
                continue
            start = time.monotonic()
            try:
                print(f"ok    {tell()} ({time.monotonic() - start:.0f} s)", flush=True)
            except (Failed, subprocess.CalledProcessError) as error:
                print(f"FAIL  {story}: {error}", flush=True)
                failed += 1
            # An unexpected failure also leaves the other stories to be told, and the folder to be removed.
            except Exception:
                print(f"FAIL  {story}: {traceback.format_exc()}", flush=True)
                failed += 1
        unmount_below(folder)
    return 1 if failed else 0


def unmount_below(folder: pathlib.Path) -> None:
    """Takes off what stories have mounted, so that the folder can be removed."""
    mounts = [line.split()[1] for line in pathlib.Path("/proc/self/mounts").read_text().splitlines()]
    for path in reversed(mounts):
        if path.startswith(f"{folder}/"):
            run("umount", "--lazy", path)


def stories(folder: pathlib.Path, given: argparse.Namespace) -> dict:
    """What is tried, by name; each tells what it has shown."""
    program = given.program.resolve()
    old = pathlib.Path(os.environ.get("SKYWAY_OLD_BINARY") or program).resolve()
    haproxy = shutil.which("haproxy", path=f"{os.environ['PATH']}:/usr/sbin")

    def whole_installation() -> str:
        with installation.installed(folder / "installation", program, given.tools, drones=6, operators=4) as installed:
            told = [installation.looks_right(installed), installation.strangers_are_not_followed(installed)]
            told.append(rolling_restart.run(installed, given.restarts))
            told.append(backups.of_postgres(installed))
            told.append(installation.is_observed(installed))
        return "compose.yaml as it stands:\n        " + ";\n        ".join(told)

    return {
        "compose": files.compose,
        "kubernetes": lambda: files.kubernetes(haproxy, program, folder),
        "prometheus": lambda: files.prometheus_in_a_cluster(given.tools / "promtool"),
        "alerts": files.alerts,
        "context": files.image_context,
        "image": lambda: one_image.run_all(folder / "image", program),
        "metrics": lambda: metrics.run_all(program, folder / "metrics"),
        "exemplars": lambda: exemplars.run_all(program, given.tools, folder / "exemplars"),
        "upgrade": lambda: upgrade.run_all(folder / "upgrade", old, program),
        "edge-backup": lambda: backups.of_edge(program, folder / "edge-backup"),
        "registry-backup": lambda: backups.of_registry_file(program, folder / "registry-backup"),
        "sizing": lambda: sizing.run_all(program, folder / "sizing"),
        "units": lambda: units.run_all(folder / "units", given.package.resolve()),
        "installation": whole_installation,
    }


if __name__ == "__main__":
    sys.exit(main())

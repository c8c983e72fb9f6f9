"""A PostgreSQL cluster of its own, in a folder that is deleted with it; nothing of an installed one is touched."""

import os
import pathlib
import pwd
import shutil
import subprocess
import tempfile

INSTALLED = pathlib.Path("/usr/lib/postgresql")
# No power fails here, only processes of Skyway are killed: what PostgreSQL has committed stays with it.
SETTINGS = "-c listen_addresses='' -c fsync=off -c shared_buffers=64MB -c max_connections=200"


def programs() -> pathlib.Path | None:
    """Where the newest PostgreSQL is; `None` where there is none."""
    found = sorted(INSTALLED.glob("*/bin"), key=lambda path: float(path.parent.name))
    found = [path for path in found if (path / "initdb").exists()]
    return found[-1] if found else None


class Cluster:
    """A cluster that runs, with a database for whoever asks for one."""

    def __init__(self) -> None:
        self._programs = programs()
        assert self._programs, f"no PostgreSQL in {INSTALLED}"
        self._folder = pathlib.Path(tempfile.mkdtemp(prefix="skyway-postgresql-"))
        self._as = {}
        # It refuses to run as root.
        if os.getuid() == 0:
            postgres = pwd.getpwnam("postgres")
            os.chown(self._folder, postgres.pw_uid, postgres.pw_gid)
            self._as = {"user": postgres.pw_uid, "group": postgres.pw_gid, "extra_groups": []}
            self._folder.chmod(0o755)

    def __enter__(self) -> "Cluster":
        try:
            self._run("initdb", "--auth=trust", "--username=postgres", "--encoding=UTF8", "--locale=C", "--pgdata=data")
            self._run("pg_ctl", "--wait", "--log=log", "--pgdata=data", f"--options=-k {self._folder} {SETTINGS}", "start")
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_) -> None:
        if (self._folder / "data/postmaster.pid").exists():
            self._run("pg_ctl", "--mode=immediate", "--pgdata=data", "stop")
        shutil.rmtree(self._folder, ignore_errors=True)

    def create(self, database: str) -> str:
        """A new, empty database: its URL."""
        self._run("createdb", f"--host={self._folder}", "--username=postgres", database)
        return f"postgres://postgres@localhost/{database}?host={self._folder}"

    def drop(self, database: str) -> None:
        """Drops it, whoever is still connected."""
        self._run("dropdb", f"--host={self._folder}", "--username=postgres", "--force", database)

    def _run(self, program: str, *arguments: str) -> None:
        ran = subprocess.run(
            [self._programs / program, *arguments], cwd=self._folder, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, **self._as)
        assert ran.returncode == 0, f"{program}: {ran.returncode} {ran.stderr}"

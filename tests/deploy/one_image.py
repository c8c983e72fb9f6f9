"""The entry point of the image as it stands, by its own user, in a folder with what the image has and nothing else."""

import pathlib

from machine import Caller, Container, Image, expect, until


def run_all(folder: pathlib.Path, program: pathlib.Path) -> str:
    """Starts it with its default command, twice over the same volume."""
    image = Image(folder / "image", program)
    container = Container(image, folder / "container", "image", {})
    client = Caller("127.0.0.1", 8080)
    epochs = []
    for _ in range(2):
        process = container.start()
        until("the entry point serves", lambda: client.ask("GET", "/readyz")[0] == 200 or not process.is_running())
        expect(process.is_running(), f"the entry point ends:\n{process.log()}")
        owner = pathlib.Path(f"/proc/{process.pid()}").stat()
        expect(f"{owner.st_uid}:{owner.st_gid}" == image.user, f"it runs as {owner.st_uid}:{owner.st_gid}, not {image.user}")
        expect(owner.st_uid != 0, "it runs as root")
        epochs.append(client.done("GET", "/v1/zones")["revision"])
        process.end()
        client = Caller("127.0.0.1", 8080)
    expect((container.state() / "edge.db").exists(), "the store is not on the volume")
    expect(epochs[0] < epochs[1], f"the second start has {epochs[1]}, the first had {epochs[0]}")
    exposed = container.start(["edge", "--listen", "0.0.0.0:8080"])
    expect(exposed.wait() == 78, "it serves other machines without tokens")
    size_mb = sum(path.stat().st_size for path in image.folder.rglob("*") if path.is_file()) / 1e6
    return f"the image's entry point: ready, uid {image.user}, store on the volume, ends in order; off loopback without tokens 78 ({size_mb:.0f} MB unstripped)"

"""GeoJSON of whatever holds it: text, a mapping, a GeoDataFrame."""

from __future__ import annotations

import json
from typing import Any


def is_table(given: object) -> bool:
    """True for a GeoDataFrame, without asking for GeoPandas."""
    return hasattr(given, "to_crs")


def geojson_text(given: object) -> str | None:
    """GeoJSON as text; None stays None."""
    if given is None or isinstance(given, str):
        return given
    return json.dumps(collection_of(given))


def collection_of(given: Any) -> Any:
    """A feature collection of a GeoDataFrame, in longitude and latitude; anything else as it is.

    A column `id`, else the index, names the features. Members without a value are left out.
    """
    if not is_table(given):
        return given
    if given.crs is not None and given.crs.to_epsg() != 4326:
        given = given.to_crs(4326)
    features = json.loads(given.to_json(na="drop", drop_id=True))["features"]
    for feature, index in zip(features, given.index):
        stated = feature["properties"].pop("id", None)
        feature["id"] = str(index if stated is None else stated)
    return {"type": "FeatureCollection", "features": features}

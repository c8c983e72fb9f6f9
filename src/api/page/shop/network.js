// A network of the registry as the map and the fields use it.

import { read } from "./api.js";

/** Reads a network: nodes with names and pads, and which are connected. */
export async function readNetwork(id) {
  const document = await read(`/v1/networks/${encodeURIComponent(id)}`);
  const network = {
    id,
    name: document.name ?? id,
    attribution: document.attribution ?? "",
    geographic: document.skyway?.coordinates === "geographic",
    ids: [],
    names: [],
    coordinates: [],
    pads: [],
    segments: [],
    index: new Map(),
  };
  for (const { id: node, geometry, properties } of document.features) {
    if (geometry.type !== "Point") continue;
    network.index.set(String(node), network.ids.length);
    network.ids.push(String(node));
    network.names.push(properties?.name ?? "");
    network.coordinates.push(geometry.coordinates[0], geometry.coordinates[1]);
    network.pads.push(properties?.pads ?? 0);
  }
  for (const { geometry, properties } of document.features) {
    if (geometry.type !== "LineString") continue;
    const ends = [network.index.get(String(properties.from)), network.index.get(String(properties.to))];
    if (ends.every((end) => end !== undefined)) network.segments.push(...ends);
  }
  return network;
}

/** The longitude and latitude of a node, or undefined. */
export function placeOf(network, id) {
  const node = network?.index.get(id);
  return node === undefined ? undefined : network.coordinates.slice(2 * node, 2 * node + 2);
}

/** A node with its name, where it has one. */
export function nodeName(network, id) {
  const name = network?.names[network.index.get(id)];
  return name ? `${id} (${name})` : id;
}

/** Whether drones can land on a node. */
export function hasPads(network, id) {
  return network.pads[network.index.get(id)] > 0;
}

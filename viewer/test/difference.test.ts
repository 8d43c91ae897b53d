import assert from "node:assert/strict";
import { test } from "node:test";
import { difference } from "../src/difference";
import { Flight } from "../src/flight";
import { someFlight } from "./some_flight";

test("energy is that of all UAS until then, between samples in proportion", () => {
  const flight = new Flight(someFlight());
  const perSample = (2 * 150 * 0.5) / 3600;
  for (const [time, samples] of [[0, 0], [0.5, 1], [0.75, 1.5], [1, 2], [9, 2]]) {
    assert.ok(Math.abs(flight.energy(time) - samples * perSample) < 1e-9);
  }
});

test("the difference of two flights is told with its signs", () => {
  const mine = new Flight(someFlight());
  const theirs = someFlight();
  theirs.planner = "tour";
  theirs.energy.values = theirs.energy.values.map((value) => 100 * value);
  theirs.covered = [0, 0, 0];
  assert.equal(
    difference(mine, new Flight(theirs), 1),
    "beside tour: −8.25 Wh, +1 waypoint, as long",
  );
  assert.equal(
    difference(mine, new Flight({ ...theirs, dt_s: 1 }), 0),
    "beside tour: ±0.00 Wh, ±0 waypoints, ends 1 s earlier",
  );
});

test("flights of other missions are not shown in one scene", () => {
  const flight = new Flight(someFlight());
  const other = someFlight();
  assert.ok(flight.sameMission(new Flight(other)));
  other.scene.waypoints = [{ at: [1, 2, 3], radius: 4, heavy: false, from: 0, until: null }];
  assert.ok(!flight.sameMission(new Flight(other)));
});

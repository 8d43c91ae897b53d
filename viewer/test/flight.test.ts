import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { Flight, homeAt, words } from "../src/flight";
import type { Point3 } from "../src/flight_data";
import { someFlight } from "./some_flight";

const near = (found: number[], expected: number[], by = 1e-9) => {
  assert.equal(found.length, expected.length);
  found.forEach((value, k) => assert.ok(Math.abs(value - expected[k]) <= by, `${found}`));
};

test("between samples a UAS is on the straight line, and so is its charge", () => {
  const { vehicles, sample } = new Flight(someFlight()).moment(0.75);
  assert.equal(sample, 1);
  near(vehicles[0].position, [2, 2, -3]);
  near([vehicles[0].soc, vehicles[0].speed], [0.98, 4]);
});

test("what moves is between samples, too", () => {
  near(new Flight(someFlight()).moment(0.25).moving[0], [0, 0.5, -10]);
});

test("times before the start and after the end show the first and the last sample", () => {
  const flight = new Flight(someFlight());
  near(flight.moment(-7).vehicles[0].position, [0, 0, 0]);
  const end = flight.moment(99);
  assert.equal(end.time, flight.duration);
  assert.equal(end.sample, 2);
  near(end.vehicles[0].position, [3, 2, -3]);
});

test("a time that falls short of its sample by rounding still shows the sample", () => {
  assert.equal(new Flight(someFlight()).moment(0.5 - 1e-9).sample, 1);
  assert.equal(new Flight(someFlight()).moment(0.5 - 1e-3).sample, 0);
});

test("a curve ends where its UAS landed or was lost", () => {
  const flight = new Flight(someFlight());
  near(flight.column(flight.data.soc, 0), [1, 0.99, 0.97]);
  near(flight.column(flight.data.soc, 1), [0.9, 0.89]);
});

test("predictions are in metres, and none where none was made", () => {
  const flight = new Flight(someFlight());
  near(flight.predicted(0, 0), [1, 2, 3]);
  assert.deepEqual([flight.predicted(0, 1), flight.predicted(1, 0), flight.predicted(9, 0)], [[], [], []]);
});

test("a violation is shown where its UAS was then", () => {
  const flight = new Flight(someFlight());
  near(flight.where(flight.data.violations[0]), [5, 1, 0]);
  assert.equal(flight.mode(1, 1), "lost");
});

test("a flight that Python wrote is read as Python recorded it", () => {
  const path = process.env.FLIGHT;
  if (!path) return; // tests/replay/test_viewer.py hands one over
  const { data, expected } = JSON.parse(readFileSync(path, "utf8"));
  const flight = new Flight(data);
  assert.equal(flight.duration, expected.duration_s);
  assert.ok(expected.moments.length > 3);
  for (const { time_s, position_m, soc, mode, covered, energy_Wh } of expected.moments) {
    const moment = flight.moment(time_s);
    moment.vehicles.forEach((vehicle, i) => {
      near(vehicle.position, position_m[i], 0.006);
      near([vehicle.soc], [soc[i]], 6e-5);
      assert.equal(vehicle.mode, mode[i]);
    });
    assert.equal(moment.covered, covered);
    near([flight.energy(time_s)], [energy_Wh], 6e-4 * flight.uas);
  }
});

test("charge to spare is what is left beyond the way home", () => {
  const flight = new Flight(someFlight());
  const [first, second] = flight.moment(0.25).vehicles;
  assert.ok(Math.abs(first.spare - (0.995 - 0.225)) < 1e-9);
  assert.ok(Math.abs(second.spare - (0.895 - 0.25)) < 1e-9);
});

test("a violation says what was hit, what was exceeded, or that a UAS was out of control", () => {
  const told = (kind: string, more: object) => words({ t_s: 1, uas: "uas_1", kind, with: null, ...more });
  assert.equal(told("obstacle", { with: "church" }), "uas_1, obstacle contact with church");
  assert.equal(told("limit", { with: "tilt", value: 0.5, limit: 0.4 }), "uas_1 beyond its limit of tilt, 0.500 of 0.400");
  assert.equal(told("limits", {}), "uas_1, out of control beyond its limits");
});

test("a mark is told of while it lasts, a violation at its sample", () => {
  const flight = new Flight(someFlight());
  const told = (time: number) => flight.at(time).map(({ kind }) => kind);
  assert.deepEqual(told(0), []);
  assert.deepEqual(told(0.5), ["violation", "breach"]);
  assert.deepEqual(told(1), ["breach"]);
});

test("least charge to spare matters where it was little, passed, or is looked at", () => {
  const flight = new Flight(someFlight());
  assert.equal(flight.nearNoReturn(0, null), true);
  assert.equal(flight.nearNoReturn(1, null), false);
  assert.equal(flight.nearNoReturn(1, 1), true);
});

test("a waypoint is asked for from when it is added until it is dropped", () => {
  const data = someFlight();
  data.scene.waypoints = [
    { at: [1, 2, -3], radius: 4, heavy: false, from: 0, until: 2 },
    { at: [9, 2, -3], radius: 4, heavy: false, from: 1, until: null },
  ];
  const flight = new Flight(data);
  assert.deepEqual([0, 1, 2].map((k) => flight.asked(0, k)), [true, true, false]);
  assert.deepEqual([0, 1, 2].map((k) => flight.asked(1, k)), [false, true, true]);
  assert.deepEqual([0, 1, 2].map((k) => flight.askedFor(k)), [1, 2, 1]);
});

test("home is where it was last moved to", () => {
  const homes = [
    { from: 0, at: [0, 0, 0] as Point3 },
    { from: 2, at: [5, 0, 0] as Point3 },
  ];
  assert.deepEqual([0, 1, 2, 7].map((k) => homeAt(homes, k)[0]), [0, 0, 5, 5]);
});

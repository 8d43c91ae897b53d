import assert from "node:assert/strict";
import { test } from "node:test";
import { Flight } from "../src/flight";
import { coveredBy, legs, legWords, waypointWords } from "../src/legs";
import { Picker } from "../src/pick";
import { table } from "../src/table";
import { someFlight } from "./some_flight";

/** The first UAS covers the first waypoint at the second sample, nobody the other one. */
function flown(ceiling = 30): Flight {
  const data = someFlight();
  data.scene.fence.corners = [[0, 0, 0], [9, 9, -ceiling]];
  data.scene.waypoints = [
    { at: [1, 2, -3.2], radius: 4, heavy: false, from: 0, until: null },
    { at: [40, 40, -3], radius: 4, heavy: false, from: 0, until: null },
  ];
  data.covered_at = [1, 3];
  return new Flight(data);
}

test("a waypoint was covered by the UAS that was nearest then, or is open", () => {
  assert.deepEqual(coveredBy(flown()), [0, null]);
});

test("legs lie between waypoints, the last one goes to the end of the flight", () => {
  assert.deepEqual(legs(flown(), 0, [0, null]), [
    { uas: 0, from: 0, to: 1, waypoint: 0 },
    { uas: 0, from: 1, to: 2, waypoint: null },
  ]);
  assert.deepEqual(legs(flown(), 1, [0, null]), [{ uas: 1, from: 0, to: 1, waypoint: null }]);
});

test("a waypoint and a leg say when, by whom, at what height and speed", () => {
  const flight = flown();
  const by = coveredBy(flight);
  assert.equal(
    waypointWords(flight, 0, by),
    "Waypoint 1, N 1 m, E 2 m, 3.2 m high: covered at 0.5 s by uas_1, 3.0 m high at 4.0 m/s",
  );
  assert.match(waypointWords(flight, 1, by), /not covered$/);
  // from (0, 0, 0) to (1, 2, -3) m in half a second, at 15 V and 10 A
  assert.equal(
    legWords(flight, legs(flight, 0, by)[0]),
    "uas_1 to waypoint 1, 0 s to 0.5 s: 4 m at 7.5 m/s, 0 to 3 m high, 0.02 Wh",
  );
});

test("a click finds the vehicle before the waypoint, the waypoint before the path", () => {
  const flight = flown();
  const picker = new Picker(flight);
  // a pixel to a metre
  const pixel = ([north, east]: number[]): [number, number] => [10 * east, -10 * north];
  const at = (north: number, east: number) =>
    picker.at(10 * east, -10 * north, flight.moment(1), (point) => pixel(point));
  assert.equal(at(3, 2)?.uas, 0);
  assert.equal(at(3, 2)?.words, "");
  assert.match(at(1.1, 2)!.words, /^Waypoint 1/);
  assert.match(at(0.2, 0.1)!.words, /^uas_1 to waypoint 1/);
  assert.match(at(40, 43)!.words, /^Waypoint 2/, "in its ring, where nothing else is");
  assert.equal(at(40, 45), null);
  assert.equal(at(-20, 20), null);
});

test("the table has a row for each UAS and sample until its end", () => {
  const data = someFlight();
  data.scene.uas[1].name = 'the "second", of two';
  const rows = table([new Flight(data)]).trim().split("\n");
  assert.equal(rows.length, 1 + 3 + 2);
  assert.equal(rows[0].split(",").length, 12);
  assert.equal(rows[2], "1,0.5,uas_1,1,2,-3,0.99,0.25,15,10,covering,1");
  assert.match(rows[4], /^1,0,"the ""second"", of two",5,0,0,/);
});

test("in a room, places and heights have decimals", () => {
  const flight = flown(2.5);
  assert.equal(flight.metres(1.23), "1.2");
  assert.match(waypointWords(flight, 0, coveredBy(flight)), /^Waypoint 1, N 1\.0 m, E 2\.0 m, 3\.2 m high/);
});

import assert from "node:assert/strict";
import { test } from "node:test";
import { Flight } from "../src/flight";
import { ramp } from "../src/ramp";
import { Trail, trailValues } from "../src/trail";
import { someFlight } from "./some_flight";

test("a trail has the value of each sample", () => {
  const flight = new Flight(someFlight());
  assert.deepEqual(trailValues(flight, 0, "height"), [0, 3, 3]);
  assert.deepEqual(trailValues(flight, 0, "power"), [150, 150, 150]);
  assert.deepEqual(trailValues(flight, 0, "charge").map(Math.round), [100, 99, 97]);
  assert.equal(trailValues(flight, 1, "height").length, 2, "until it was lost");
});

test("speed is the way to the next sample over the time between them", () => {
  const flight = new Flight(someFlight());
  const [first, second, last] = trailValues(flight, 0, "speed");
  assert.ok(Math.abs(first - Math.sqrt(14) / 0.5) < 1e-9);
  assert.equal(second, 4);
  assert.equal(last, 4);
});

test("all trails of a page have one scale", () => {
  const flight = new Flight(someFlight());
  const trail = new Trail("height", [flight]);
  assert.deepEqual([trail.low, trail.high], [0, 3]);
  assert.equal(trail.colour(flight, 0, 0), ramp(0));
  assert.equal(trail.colour(flight, 0, 1), ramp(1));
  assert.equal(trail.colour(flight, 1, 5), ramp(0), "beyond its end as at its end");
});

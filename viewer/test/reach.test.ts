import assert from "node:assert/strict";
import { test } from "node:test";
import type { ReachData } from "../src/flight_data";
import { Flight } from "../src/flight";
import { reachable } from "../src/reach";
import { someFlight } from "./some_flight";

/** Home in the middle: a thousandth of the charge for each metre away from it. */
function around(): ReachData {
  const values = [];
  for (let north = -200; north <= 200; north += 10) {
    for (let east = -200; east <= 200; east += 10) {
      values.push(2000 + 10 * Math.hypot(north, east));
    }
  }
  return {
    from: 0,
    north: [-200, 10, 41],
    east: [-200, 10, 41],
    height: 15,
    needed: { unit: 0.0001, values },
    per_m: [0.001],
    fixed: [0],
  };
}

test("above home half of what is left takes it there, the other half back", () => {
  const corners = reachable(around(), 0, [0, 0, -5], 0.4);
  assert.equal(corners.length, 72);
  for (const [north, east, down] of corners) {
    assert.ok(Math.abs(Math.hypot(north, east) - 100) < 0.5, `${north} ${east}`);
    assert.equal(down, -15);
  }
});

test("away from home the area is an ellipse about both, and shrinks with the charge", () => {
  for (const [soc, way] of [
    [0.4, 200],
    [0.33, 130],
  ]) {
    for (const [north, east] of reachable(around(), 0, [60, 0, -5], soc)) {
      const there = Math.hypot(north - 60, east) + Math.hypot(north, east);
      assert.ok(Math.abs(there - way) < 1, `${there}`);
    }
  }
});

test("with no more than the way home takes nothing can be reached, nor beyond the fence", () => {
  assert.deepEqual(reachable(around(), 0, [60, 0, -5], 0.26), []);
  assert.deepEqual(reachable(around(), 0, [900, 0, -5], 1), []);
  for (const [north, east] of reachable(around(), 0, [0, 0, -5], 1)) {
    assert.ok(Math.max(Math.abs(north), Math.abs(east)) <= 200);
  }
});

test("of a UAS that has landed, is lost, or is beyond the point of no return there is no area", () => {
  const flight = new Flight(someFlight());
  assert.equal(flight.reach(flight.moment(0), 0).length, 72);
  assert.deepEqual(flight.reach(flight.moment(1), 0), [], "less than nothing to spare");
  assert.deepEqual(flight.reach(flight.moment(1), 1), [], "lost");
});

import assert from "node:assert/strict";
import { test } from "node:test";
import { Clock, SPEEDS } from "../src/clock";

function clock(duration = 100) {
  let changes = 0;
  const made = new Clock(duration, () => changes++);
  return { made, changes: () => changes };
}

test("time is set within the flight", () => {
  const { made, changes } = clock();
  made.seek(-5);
  assert.equal(made.time, 0);
  made.seek(500);
  assert.equal(made.time, 100);
  assert.equal(changes(), 2);
});

test("a second of real time is ten of flight, and more or less at other speeds", () => {
  const { made } = clock();
  made.toggle();
  const start = performance.now();
  made.tick(start);
  const begun = made.time;
  made.tick(start + 400);
  assert.ok(Math.abs(made.time - begun - 4) < 1e-9);
  made.faster(1);
  made.tick(start + 800);
  assert.ok(Math.abs(made.time - begun - 4 - 0.4 * made.speed) < 1e-9);
});

test("a page that slept goes on where it was", () => {
  const { made } = clock();
  made.toggle();
  const start = performance.now();
  made.tick(start);
  const begun = made.time;
  made.tick(start + 60_000);
  assert.ok(made.time - begun <= 0.5 * made.speed + 1e-9);
});

test("at the end it stands, and plays from the start again", () => {
  const { made } = clock(1);
  made.toggle();
  const start = performance.now();
  made.tick(start);
  made.tick(start + 400);
  assert.deepEqual([made.time, made.playing], [1, false]);
  made.toggle();
  assert.deepEqual([made.time, made.playing], [0, true]);
  made.pause();
  assert.equal(made.playing, false);
});

test("speeds end at the slowest and the fastest", () => {
  const { made } = clock();
  made.faster(-99);
  assert.equal(made.speed, SPEEDS[0]);
  made.faster(99);
  assert.equal(made.speed, SPEEDS.at(-1));
});

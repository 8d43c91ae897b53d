import assert from "node:assert/strict";
import { test } from "node:test";
import { bandOf } from "../src/band";
import { Pace } from "../src/pace";

test("a band has the least, the median and the greatest of all, what ended stays where it was", () => {
  const band = bandOf([[1, 5, 9], [2, 2, 2], [7]]);
  assert.deepEqual(band.least, [1, 2, 2]);
  assert.deepEqual(band.median, [2, 5, 7]);
  assert.deepEqual(band.greatest, [7, 7, 9]);
});

test("slow pictures get coarse while something moves, and fine once it stands", () => {
  const told: boolean[] = [];
  const pace = new Pace((coarse) => told.push(coarse));
  let now = 0;
  const drawn = (ms: number, moved: boolean) => pace.tick((now += ms), moved);
  drawn(16, true);
  for (let n = 0; n < 20; n++) drawn(16, true);
  assert.deepEqual(told, [], "fast enough");
  for (let n = 0; n < 9; n++) drawn(120, n % 2 === 0);
  assert.deepEqual(told, [], "one picture now and then may take its time");
  for (let n = 0; n < 4; n++) drawn(120, true);
  assert.deepEqual(told, [true]);
  for (let n = 0; n < 4; n++) drawn(30, true);
  assert.deepEqual(told, [true], "it still moves");
  for (let n = 0; n < 20; n++) drawn(16, false);
  assert.deepEqual(told, [true, false]);
});

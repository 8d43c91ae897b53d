import assert from "node:assert/strict";
import { test } from "node:test";
import { contrast, LEGIBLE, readOn } from "../src/contrast";

test("contrast goes from 1 to 21, whichever of both is the ground", () => {
  assert.equal(contrast("#777777", "#777777"), 1);
  assert.ok(Math.abs(contrast("#000000", "#ffffff") - 21) < 1e-9);
  assert.equal(contrast("#123456", "#abcdef"), contrast("#abcdef", "#123456"));
});

test("words are no farther from the colour of their line than it takes to read them", () => {
  for (const hex of ["#e69f00", "#56b4e9", "#009e73"]) {
    const words = readOn("#ffffff", hex, 0);
    assert.ok(words !== hex);
    assert.ok(contrast(words, "#ffffff") >= LEGIBLE);
    assert.ok(contrast(words, "#ffffff") < 1.25 * LEGIBLE);
  }
  assert.equal(readOn("#ffffff", "#0072b2", 0), "#0072b2", "it is read as it is");
  assert.ok(contrast(readOn("#1b1f21", "#26282c", 255), "#1b1f21") >= LEGIBLE);
});

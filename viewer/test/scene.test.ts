import assert from "node:assert/strict";
import { test } from "node:test";
import { roundStep } from "../src/round_step";
import { bodyGeometry, place } from "../src/scene_space";

test("north is away from the eye, east to the right, and down is down", () => {
  assert.deepEqual(place([1, 0, 0]).toArray().map(Math.round).map((v) => v + 0), [0, 0, -1]);
  assert.deepEqual(place([0, 1, 0]).toArray().map((v) => v + 0), [1, 0, 0]);
  assert.deepEqual(place([0, 0, -10]).toArray().map((v) => v + 0), [0, 10, 0]);
});

test("a body has three corners of its own for each triangle, and flat faces", () => {
  const corners: [number, number, number][] = [
    [0, 0, 0],
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, -1],
  ];
  const geometry = bodyGeometry({
    corners,
    triangles: [
      [0, 1, 2],
      [0, 1, 3],
    ],
    outline: [],
  });
  assert.equal(geometry.getAttribute("position").count, 6);
  const normals = geometry.getAttribute("normal");
  for (let k = 0; k < 6; k++) {
    const first = k < 3 ? 0 : 3;
    assert.deepEqual(
      [normals.getX(k), normals.getY(k), normals.getZ(k)],
      [normals.getX(first), normals.getY(first), normals.getZ(first)],
    );
  }
});

test("a step of an axis is the largest of 1, 2, 5 times a power of ten that is not too large", () => {
  for (const [most, step] of [
    [1, 1],
    [1.99, 1],
    [2, 2],
    [4.9, 2],
    [5, 5],
    [9.99, 5],
    [10, 10],
    [730, 500],
    [0.03, 0.02],
    [0.05, 0.05],
  ]) {
    const found = roundStep(most);
    assert.ok(Math.abs(found / step - 1) < 1e-9, `${most}: ${found}`);
  }
});

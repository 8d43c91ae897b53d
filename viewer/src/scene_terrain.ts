// What stands still: ground, water, fence, obstacles, and trees where an obstacle is a forest.

import { bounds } from "./bounds";
import {
  BufferGeometry,
  Color,
  ConeGeometry,
  EdgesGeometry,
  Float32BufferAttribute,
  Group,
  InstancedMesh,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  Mesh,
  MeshLambertMaterial,
  type Object3D,
  PlaneGeometry,
  RingGeometry,
  Shape,
  ShapeGeometry,
  Vector3,
} from "three";
import type { Obstacle, Point2, Point3, Scene } from "./flight_data";
import { bodyGeometry } from "./scene_space";
import { bright, colour, darker, dim } from "./palette";
import { roundStep } from "./round_step";

const TREE_AREA_M2 = 130;
const MOST_TREES = 420;
/** Kind of a decoration -> its layer on the ground; all others lie in the second. */
const LAYERS: Record<string, number> = { water: 1, street: 3 };

export interface Extent {
  centre: Vector3;
  /** Half of the fence's largest horizontal side [m]. */
  half: number;
  /** Height of the ground in the scene. */
  ground: number;
  corners: Vector3[];
  /** Between the lines of the grid [m]. */
  step: number;
  signs: Sign[];
}

/** Words on the ground, and where. */
export type Sign = [string, Point3];

export function extentOf(scene: Scene): Extent {
  const corners = scene.fence.corners.map(([n, e, d]) => new Vector3(e, -d, -n));
  const low = corners.reduce((a, b) => a.clone().min(b));
  const high = corners.reduce((a, b) => a.clone().max(b));
  const half = Math.max(high.x - low.x, high.z - low.z) / 2;
  const centre = low.clone().add(high).multiplyScalar(0.5);
  const step = roundStep(half / 2);
  const signs: Sign[] = [
    ["N", [-low.z + 0.09 * half, centre.x, -low.y]],
    [`grid ${step} m`, [-high.z - 0.08 * half, low.x + 0.5 * step, -low.y]],
  ];
  return { centre, half, ground: low.y, corners, step, signs };
}

/** What stands still, and what of it is there at a sample: events add obstacles and move homes. */
export interface Terrain {
  group: Group;
  /** Show what is there; whether that is something else than before. */
  at(sample: number): boolean;
}

export function terrain(scene: Scene, extent: Extent): Terrain {
  const group = new Group();
  const { centre, half, ground } = extent;
  // layers on the ground (`LAYERS`), so far apart that no depth buffer mixes them up
  const layer = half * 6e-4;
  const outside = new Mesh(
    new PlaneGeometry(24 * half, 24 * half),
    new MeshLambertMaterial({ color: colour("--outside") }),
  );
  outside.rotation.x = -Math.PI / 2;
  outside.position.set(centre.x, ground - 2 * layer, centre.z);
  group.add(outside, area(scene.fence.outline, colour("--ground"), ground - layer));
  group.add(gridLines(scene.fence.outline, ground, extent.step));
  for (const item of scene.decorations) {
    group.add(area(item.outline, dim(item.colour), ground + (LAYERS[item.kind] ?? 2) * layer));
  }
  const changing: { part: Object3D; from: number; until: number }[] = [];
  for (const obstacle of scene.obstacles) {
    const parts = obstacleParts(obstacle);
    group.add(...parts);
    for (const part of parts) changing.push({ part, from: obstacle.from, until: Infinity });
  }
  for (const { homes, colour: hex } of scene.uas) {
    homes.forEach(({ from, at }, n) => {
      const part = pad(at, hex, ground + 4 * layer, half);
      group.add(part);
      changing.push({ part, from, until: homes[n + 1]?.from ?? Infinity });
    });
  }
  const fence = new EdgesGeometry(bodyGeometry(scene.fence), 1);
  group.add(new LineSegments(fence, new LineBasicMaterial({ color: colour("--fence") })));
  const at = (sample: number): boolean => {
    const wrong = changing.filter(({ part, from, until }) => part.visible !== (from <= sample && sample < until));
    for (const { part } of wrong) part.visible = !part.visible;
    return wrong.length > 0;
  };
  return { group, at };
}

/** Where a UAS starts and lands. */
function pad([n, e]: Point3, hex: string, height: number, half: number): Mesh {
  const ring = new RingGeometry(0.013 * half, 0.02 * half, 40);
  const mesh = new Mesh(ring, new MeshLambertMaterial({ color: bright(hex) }));
  mesh.rotation.x = -Math.PI / 2;
  mesh.position.set(e, height, -n);
  return mesh;
}

function area(outline: Point2[], paint: string, height: number): Mesh {
  const shape = new Shape();
  outline.forEach(([n, e], i) => (i === 0 ? shape.moveTo(e, n) : shape.lineTo(e, n)));
  const mesh = new Mesh(new ShapeGeometry(shape), new MeshLambertMaterial({ color: paint }));
  mesh.rotation.x = -Math.PI / 2;
  mesh.position.y = height;
  mesh.receiveShadow = true;
  return mesh;
}

/** Lines every 1, 2 or 5 times a power of ten metres, some five over the area. */
function gridLines(outline: Point2[], ground: number, step: number): LineSegments {
  const values: number[] = [];
  const [low, high] = bounds(outline);
  for (let n = Math.ceil(low[0] / step) * step; n <= high[0]; n += step) {
    values.push(low[1], ground, -n, high[1], ground, -n);
  }
  for (let e = Math.ceil(low[1] / step) * step; e <= high[1]; e += step) {
    values.push(e, ground, -low[0], e, ground, -high[0]);
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(values, 3));
  return new LineSegments(geometry, new LineBasicMaterial({ color: colour("--grid") }));
}

function obstacleParts(obstacle: Obstacle): (Mesh | LineSegments | InstancedMesh)[] {
  const geometry = bodyGeometry(obstacle);
  const paint = dim(obstacle.colour);
  const forest = obstacle.kind === "forest";
  const body = new Mesh(
    geometry,
    new MeshLambertMaterial({
      color: paint,
      transparent: forest,
      opacity: forest ? 0.3 : 1,
      // what is inside and behind is to be seen through a forest's hull
      depthWrite: !forest,
    }),
  );
  body.castShadow = body.receiveShadow = !forest;
  const edges = new LineSegments(
    new EdgesGeometry(geometry, 1),
    new LineBasicMaterial({ color: darker(obstacle.colour, forest ? 0.35 : 0.5) }),
  );
  return forest ? [body, edges, trees(obstacle)] : [body, edges];
}

/** Trees that fill a hull; they are decoration: the hull is the obstacle. */
function trees(obstacle: Obstacle): InstancedMesh {
  const spots = treeSpots(obstacle);
  const cone = new ConeGeometry(1, 1, 6);
  cone.translate(0, 0.5, 0);
  const mesh = new InstancedMesh(cone, new MeshLambertMaterial(), spots.length);
  const base = new Color(dim(darker(obstacle.colour, 0.15)));
  spots.forEach(({ at, height, shade }, i) => {
    const width = Math.min(5.5, 0.28 * height) * (0.8 + 0.4 * shade);
    mesh.setMatrixAt(i, new Matrix4().makeScale(width, height, width).setPosition(at));
    mesh.setColorAt(i, base.clone().multiplyScalar(0.75 + 0.35 * shade));
  });
  mesh.castShadow = mesh.receiveShadow = true;
  return mesh;
}

function treeSpots(obstacle: Obstacle): { at: Vector3; height: number; shade: number }[] {
  const random = sequence(1);
  const [low, high] = [Math.min, Math.max].map((pick) =>
    [0, 1, 2].map((axis) => pick(...obstacle.corners.map((corner) => corner[axis]))),
  );
  const box = (high[0] - low[0]) * (high[1] - low[1]);
  const tries = Math.min(MOST_TREES, Math.round(box / TREE_AREA_M2));
  const faces = obstacle.triangles.map(([a, b, c]) => {
    const [p, q, r] = [a, b, c].map((i) => new Vector3(...obstacle.corners[i]));
    return { p, normal: q.sub(p).cross(r.sub(p)) };
  });
  const spots = [];
  for (let i = 0; i < tries; i++) {
    const [n, e, share, shade] = [random(), random(), random(), random()];
    const height = (high[2] - low[2]) * (0.7 + 0.28 * share);
    const north = low[0] + n * (high[0] - low[0]);
    const east = low[1] + e * (high[1] - low[1]);
    const tip = new Vector3(north, east, high[2] - height);
    if (faces.every(({ p, normal }) => normal.dot(tip.clone().sub(p)) <= 0)) {
      spots.push({ at: new Vector3(east, -high[2], -north), height, shade });
    }
  }
  return spots;
}

/** Numbers from 0 to 1 that look random and are the same in every page. */
function sequence(seed: number): () => number {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

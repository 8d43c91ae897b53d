// The vehicles with charge rings, their past and predicted paths, and lines down to the ground.

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  CanvasTexture,
  Color,
  CylinderGeometry,
  DoubleSide,
  Euler,
  Group,
  InterleavedBufferAttribute,
  Line,
  LineBasicMaterial,
  LineDashedMaterial,
  Mesh,
  MeshLambertMaterial,
  Points,
  PointsMaterial,
  Sprite,
} from "three";
import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import type { Flight, Moment, VehicleMoment } from "./flight";
import { charge, cross, ghost, landed, shortName } from "./marks";
import { bright, colour, ofSpare } from "./palette";
import { badge, drawn, redraw } from "./scene_sprites";
import { place } from "./scene_space";
import type { Trail } from "./trail";

const MOST_PREDICTED = 256;
const WIDTH_PX = 2.4;
const PALE = { linewidth: 1.5, transparent: true, opacity: 0.55 };

export class Vehicles {
  readonly group = new Group();
  private readonly parts: VehicleParts[];

  /** @param ghosts they are of another flight: pale, and without what they mean to do */
  constructor(flight: Flight, ground: number, ghosts = false) {
    this.parts = flight.scene.uas.map((_, i) => new VehicleParts(flight, i, ground, ghosts));
    for (const part of this.parts) this.group.add(part.group);
  }

  setTrail(trail: Trail): void {
    for (const part of this.parts) part.setTrail(trail);
  }

  /** Sizes in pixels become sizes in the scene by the height of one pixel at distance 1. */
  draw(moment: Moment, pixel: number, distanceTo: (i: number) => number): void {
    this.parts.forEach((part, i) => part.draw(moment, pixel, distanceTo(i)));
  }
}

class VehicleParts {
  readonly group = new Group();
  private readonly body: Group;
  private readonly ring: Sprite;
  private readonly ringTexture: CanvasTexture;
  private ringShows = "";
  private readonly path: Line2;
  private readonly latest: Line2;
  private readonly latestPaint: LineMaterial;
  private trail: Trail | null = null;
  private readonly drop: Line;
  private readonly predicted: Line;
  private readonly predictedDots: Points;

  constructor(
    private readonly flight: Flight,
    private readonly i: number,
    private readonly ground: number,
    private readonly isGhost: boolean,
  ) {
    const ink = bright(flight.scene.uas[i].colour);
    this.body = quadcopter(ink);
    const look = isGhost ? PALE : { linewidth: WIDTH_PX };
    this.ringTexture = drawn(() => undefined);
    this.ring = badge(this.ringTexture);
    // above the names of other things
    this.ring.renderOrder += 1;
    const samples = [];
    for (let k = 0; k <= flight.data.last[i]; k++) {
      samples.push(...place(flight.position(k, i)).toArray());
    }
    // a line needs two points
    if (samples.length === 3) samples.push(...samples);
    this.path = wide(samples, new LineMaterial({ vertexColors: true, ...look }));
    this.latestPaint = new LineMaterial({ color: ink, ...look });
    this.latest = wide([0, 0, 0, 0, 0, 0], this.latestPaint);
    this.drop = new Line(points(2), new LineBasicMaterial({ color: ink }));
    this.predicted = new Line(
      points(MOST_PREDICTED),
      new LineDashedMaterial({ color: ink, dashSize: 3, gapSize: 3 }),
    );
    this.predictedDots = new Points(
      this.predicted.geometry,
      new PointsMaterial({
        color: ink,
        size: 6,
        sizeAttenuation: false,
        map: drawn(disc),
        alphaTest: 0.5,
      }),
    );
    this.group.add(this.path, this.latest, this.drop, this.body, this.ring);
    this.group.add(this.predicted, this.predictedDots);
    // their extents change with every moment
    for (const part of this.group.children) part.frustumCulled = false;
  }

  setTrail(trail: Trail): void {
    this.trail = trail;
    const ink = bright(this.flight.scene.uas[this.i].colour);
    const colours: number[] = [];
    for (let k = 0; k <= Math.max(1, this.flight.data.last[this.i]); k++) {
      colours.push(...new Color(trail.colour(this.flight, this.i, k) ?? ink).toArray());
    }
    this.path.geometry.setColors(colours);
  }

  draw(moment: Moment, pixel: number, distance: number): void {
    const vehicle = moment.vehicles[this.i];
    const at = place(vehicle.position);
    const flies = vehicle.mode !== "landed" && vehicle.mode !== "lost";
    this.body.visible = flies && !this.isGhost;
    this.body.position.copy(at);
    const [phi, theta, psi] = vehicle.attitude;
    // body axes forward, right, down are -z, x, -y of the scene at heading north
    this.body.rotation.copy(new Euler(theta, -psi, -phi, "YXZ"));
    this.body.scale.setScalar(Math.max(0.5, 22 * pixel * distance));
    this.ring.position.copy(at);
    this.ring.scale.setScalar(84 * pixel);
    this.drawRing(vehicle);
    this.drawPath(moment, at.toArray());
    setPoints(this.drop.geometry, [...at.toArray(), at.x, this.ground, at.z]);
    this.drop.visible = flies && !this.isGhost;
    const predicted = flies && !this.isGhost ? this.flight.predicted(moment.sample, this.i) : [];
    const line = [];
    for (let n = 0; n + 2 < Math.min(predicted.length, 3 * MOST_PREDICTED); n += 3) {
      line.push(predicted[n + 1], -predicted[n + 2], -predicted[n]);
    }
    setPoints(this.predicted.geometry, line);
    this.predicted.computeLineDistances();
  }

  private drawPath(moment: Moment, at: number[]): void {
    const flown = Math.min(moment.sample, this.flight.data.last[this.i]);
    this.path.geometry.instanceCount = flown;
    this.path.visible = flown > 0;
    const from = place(this.flight.position(flown, this.i)).toArray();
    const paint = this.trail?.colour(this.flight, this.i, flown);
    if (paint) this.latestPaint.color.set(paint);
    else this.latestPaint.color.set(bright(this.flight.scene.uas[this.i].colour));
    this.latest.visible = moment.sample < this.flight.data.last[this.i];
    // in place: new positions would be new memory of the graphics card in every picture
    const { data } = this.latest.geometry.getAttribute("instanceStart") as InterleavedBufferAttribute;
    data.array.set([...from, ...at]);
    data.needsUpdate = true;
  }

  /** The ring is drawn anew only when it looks different. */
  private drawRing(vehicle: VehicleMoment): void {
    const { name, colour: hex } = this.flight.scene.uas[this.i];
    const { soc, spare, mode } = vehicle;
    const shows = `${Math.round(200 * soc)} ${Math.round(200 * spare)} ${ofSpare(spare)} ${mode}`;
    if (shows === this.ringShows) return;
    this.ringShows = shows;
    redraw(this.ringTexture, (pen, px) => {
      const middle = px / 2;
      if (this.isGhost) ghost(pen, middle, middle, 0.2 * px, shortName(name), hex);
      else if (vehicle.mode === "lost") cross(pen, middle, middle, 0.17 * px);
      else if (vehicle.mode === "landed") landed(pen, middle, middle, 0.09 * px, hex);
      else charge(pen, middle, middle, 0.27 * px, soc, spare, shortName(name), hex);
    });
  }
}

function disc(pen: CanvasRenderingContext2D, px: number): void {
  pen.fillStyle = "#ffffff";
  pen.beginPath();
  pen.arc(px / 2, px / 2, px / 2, 0, 2 * Math.PI);
  pen.fill();
}

/** A quadcopter of one metre, its nose to the north, in the colour of the UAS. */
function quadcopter(ink: string): Group {
  const group = new Group();
  const frame = new MeshLambertMaterial({ color: colour("--ink") });
  const paint = new MeshLambertMaterial({ color: ink });
  const blur = new MeshLambertMaterial({
    color: ink,
    transparent: true,
    opacity: 0.55,
    side: DoubleSide,
  });
  for (const turned of [Math.PI / 4, -Math.PI / 4]) {
    const arm = new Mesh(new BoxGeometry(1.1, 0.09, 0.12), frame);
    arm.rotation.y = turned;
    group.add(arm);
  }
  for (const [x, z] of [[1, 1], [1, -1], [-1, 1], [-1, -1]]) {
    const rotor = new Mesh(new CylinderGeometry(0.27, 0.27, 0.04, 20), blur);
    rotor.position.set(0.39 * x, 0.1, 0.39 * z);
    group.add(rotor);
  }
  const nose = new Mesh(new BoxGeometry(0.16, 0.16, 0.5), paint);
  nose.position.z = -0.2;
  group.add(nose);
  return group;
}

function wide(values: number[], paint: LineMaterial): Line2 {
  const geometry = new LineGeometry();
  geometry.setPositions(values);
  return new Line2(geometry, paint);
}

function points(count: number): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(3 * count), 3));
  return geometry;
}

function setPoints(geometry: BufferGeometry, values: number[]): void {
  const attribute = geometry.getAttribute("position") as BufferAttribute;
  attribute.array.set(values);
  attribute.needsUpdate = true;
  geometry.setDrawRange(0, values.length / 3);
}

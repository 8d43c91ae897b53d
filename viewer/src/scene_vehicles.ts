// The vehicles of a flight in 3D: all bodies in three draws, lines down to the ground, and what
// their planner predicts.

import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  Color,
  CylinderGeometry,
  DoubleSide,
  Euler,
  Group,
  InstancedMesh,
  LineBasicMaterial,
  LineDashedMaterial,
  LineSegments,
  Matrix4,
  MeshLambertMaterial,
  Points,
  PointsMaterial,
  Quaternion,
  Vector3,
} from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import type { Flight, Moment } from "./flight";
import { crowded } from "./marks";
import { bright, colour } from "./palette";
import { drawn } from "./scene_sprites";
import { place } from "./scene_space";
import type { Focus } from "./view";

const MOST_PREDICTED = 128;
const BODY_PX = 22;
const LEAST_BODY_M = 0.5;
/** Size of those that are not to be shown. */
const HIDDEN = 0.5;

export class Vehicles {
  readonly group = new Group();
  private readonly bodies: InstancedMesh[];
  private readonly drops: LineSegments;
  private readonly predicted: LineSegments;
  private readonly dots: Points;

  constructor(private readonly flight: Flight, private readonly ground: number) {
    const inks = flight.scene.uas.map((uas) => new Color(bright(uas.colour)));
    const frame = new MeshLambertMaterial({ color: colour("--ink") });
    const paint = new MeshLambertMaterial();
    const blur = new MeshLambertMaterial({ transparent: true, opacity: 0.55, side: DoubleSide });
    this.bodies = [
      new InstancedMesh(arms(), frame, flight.uas),
      new InstancedMesh(nose(), paint, flight.uas),
      new InstancedMesh(rotors(), blur, flight.uas),
    ];
    for (const body of this.bodies.slice(1)) inks.forEach((ink, i) => body.setColorAt(i, ink));
    this.drops = new LineSegments(points(2 * flight.uas), new LineBasicMaterial({ vertexColors: true }));
    colourOf(this.drops.geometry).array.set(inks.flatMap((ink) => [...ink.toArray(), ...ink.toArray()]));
    const most = flight.predicts ? 2 * MOST_PREDICTED * flight.uas : 2;
    const line = { vertexColors: true, dashSize: 3, gapSize: 3 };
    this.predicted = new LineSegments(points(most), new LineDashedMaterial(line));
    this.dots = new Points(
      this.predicted.geometry,
      new PointsMaterial({
        vertexColors: true,
        size: 6,
        sizeAttenuation: false,
        map: drawn(disc),
        alphaTest: 0.5,
      }),
    );
    this.group.add(...this.bodies, this.drops);
    if (flight.predicts) this.group.add(this.predicted, this.dots);
    // their extents change with every moment
    for (const part of this.group.children) part.frustumCulled = false;
  }

  /**
   * @param pixel height of one pixel at distance 1
   * @param zoom how much nearer the eye is than where it sees the whole area
   */
  draw(moment: Moment, pixel: number, eye: Vector3, focus: Focus, zoom: number): void {
    const among = crowded(this.flight.uas, zoom, focus.uas !== null);
    const drops = this.drops.geometry.getAttribute("position") as BufferAttribute;
    moment.vehicles.forEach(({ position, attitude, mode }, i) => {
      const at = place(position);
      const flies = mode !== "landed" && mode !== "lost";
      const [phi, theta, psi] = attitude;
      const share = i === focus.uas ? 1 : focus.shown(i) ? among : HIDDEN * among;
      const wanted = BODY_PX * share * pixel * eye.distanceTo(at);
      const size = flies ? Math.max(LEAST_BODY_M, wanted) : 0;
      // body axes forward, right, down are -z, x, -y of the scene at heading north
      const turned = new Quaternion().setFromEuler(new Euler(theta, -psi, -phi, "YXZ"));
      const matrix = new Matrix4().compose(at, turned, new Vector3().setScalar(size));
      for (const body of this.bodies) body.setMatrixAt(i, matrix);
      drops.array.set([...at.toArray(), at.x, flies ? this.ground : at.y, at.z], 6 * i);
    });
    for (const body of this.bodies) body.instanceMatrix.needsUpdate = true;
    drops.needsUpdate = true;
    if (this.flight.predicts) this.drawPredicted(moment);
  }

  private drawPredicted(moment: Moment): void {
    const { geometry } = this.predicted;
    const corners: number[] = [];
    const colours: number[] = [];
    moment.vehicles.forEach(({ mode }, i) => {
      if (mode === "landed" || mode === "lost") return;
      const ahead = this.flight.predicted(moment.sample, i).slice(0, 3 * MOST_PREDICTED);
      const ink = new Color(bright(this.flight.scene.uas[i].colour)).toArray();
      for (let n = 0; n + 5 < ahead.length; n += 3) {
        corners.push(ahead[n + 1], -ahead[n + 2], -ahead[n]);
        corners.push(ahead[n + 4], -ahead[n + 5], -ahead[n + 3]);
        colours.push(...ink, ...ink);
      }
    });
    const position = geometry.getAttribute("position") as BufferAttribute;
    position.array.set(corners);
    colourOf(geometry).array.set(colours);
    position.needsUpdate = colourOf(geometry).needsUpdate = true;
    geometry.setDrawRange(0, corners.length / 3);
    this.predicted.computeLineDistances();
  }
}

function colourOf(geometry: BufferGeometry): BufferAttribute {
  return geometry.getAttribute("color") as BufferAttribute;
}

function disc(pen: CanvasRenderingContext2D, px: number): void {
  pen.fillStyle = "#ffffff";
  pen.beginPath();
  pen.arc(px / 2, px / 2, px / 2, 0, 2 * Math.PI);
  pen.fill();
}

/** A quadcopter of one metre, its nose to the north. */
function arms(): BufferGeometry {
  return mergeGeometries(
    [Math.PI / 4, -Math.PI / 4].map((turned) => new BoxGeometry(1.1, 0.09, 0.12).rotateY(turned)),
  );
}

function nose(): BufferGeometry {
  return new BoxGeometry(0.16, 0.16, 0.5).translate(0, 0, -0.2);
}

function rotors(): BufferGeometry {
  const places = [[1, 1], [1, -1], [-1, 1], [-1, -1]];
  return mergeGeometries(
    places.map(([x, z]) => new CylinderGeometry(0.27, 0.27, 0.04, 12).translate(0.39 * x, 0.1, 0.39 * z)),
  );
}

function points(count: number): BufferGeometry {
  const geometry = new BufferGeometry();
  for (const name of ["position", "color"]) {
    geometry.setAttribute(name, new BufferAttribute(new Float32Array(3 * count), 3));
  }
  return geometry;
}

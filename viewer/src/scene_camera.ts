// Where the scene is looked at from: the whole area, straight down, or after a UAS.

import { Box3, PerspectiveCamera, Spherical, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { place } from "./scene_space";
import type { Extent } from "./scene_terrain";
import type { Pose } from "./view";

const UPRIGHT_DEG = 34;

export class Camera {
  readonly lens = new PerspectiveCamera(UPRIGHT_DEG, 1, 1, 1000);
  private readonly orbit: OrbitControls;
  private followed: Vector3 | null = null;
  private whole = 1;

  constructor(canvas: HTMLCanvasElement, private readonly extent: Extent, moved: () => void) {
    this.lens.near = extent.half * 0.01;
    this.lens.far = extent.half * 30;
    this.orbit = new OrbitControls(this.lens, canvas);
    this.orbit.maxPolarAngle = 0.49 * Math.PI;
    this.orbit.minDistance = extent.half * 0.06;
    this.orbit.maxDistance = extent.half * 9;
    this.orbit.zoomToCursor = true;
    this.orbit.addEventListener("change", moved);
    this.orbit.addEventListener("start", () => (this.byHand = true));
    this.orbit.addEventListener("end", () => (this.byHand = false));
  }

  /** How much nearer the eye is than where it saw the whole area. */
  get zoom(): number {
    return this.whole / Math.max(1e-6, this.lens.position.distanceTo(this.orbit.target));
  }

  /** Turn about what is looked at [rad], tilt [rad], and come nearer by a factor. */
  move(turn: number, tilt: number, nearer: number): void {
    const away = new Spherical().setFromVector3(this.lens.position.clone().sub(this.orbit.target));
    away.theta += turn;
    away.phi = Math.min(this.orbit.maxPolarAngle, Math.max(0.001, away.phi + tilt));
    away.radius = Math.min(this.orbit.maxDistance, Math.max(this.orbit.minDistance, away.radius / nearer));
    this.lens.position.copy(this.orbit.target).add(new Vector3().setFromSpherical(away));
    this.byHand = true;
    this.orbit.update();
    this.byHand = false;
  }

  /** Whether a hand moves it just now. */
  byHand = false;

  /** From the south, so far away that the whole fence and the words beside it are in the picture. */
  overview(): void {
    this.lookFrom(new Vector3(-0.12, this.lens.aspect > 1.2 ? 0.85 : 1.3, 1));
  }

  top(): void {
    // not quite from above, where north would have no direction
    this.lookFrom(new Vector3(0, 1, 0.001));
  }

  /** Keep a point in the middle from now on; null: stand still. */
  follow(at: Vector3 | null): void {
    if (at && !this.followed) {
      const away = this.lens.position.clone().sub(this.orbit.target).setLength(1.2 * this.extent.half);
      this.orbit.target.copy(at);
      this.lens.position.copy(at).add(away);
    } else if (at && this.followed) {
      const moved = at.clone().sub(this.followed);
      this.orbit.target.add(moved);
      this.lens.position.add(moved);
    }
    this.followed = at?.clone() ?? null;
    this.orbit.enablePan = !at;
    this.orbit.zoomToCursor = !at;
    this.lens.lookAt(this.orbit.target);
  }

  get pose(): Pose {
    const offset = this.lens.position.clone().sub(this.orbit.target);
    return { offset: offset.toArray(), target: this.orbit.target.toArray() };
  }

  /** Look from where the other flight's camera looks; what is followed stays in the middle. */
  take(pose: Pose): void {
    if (!this.followed) this.orbit.target.fromArray(pose.target);
    this.lens.position.copy(this.orbit.target).add(new Vector3(...pose.offset));
    this.lens.lookAt(this.orbit.target);
  }

  private lookFrom(direction: Vector3): void {
    this.followed = null;
    this.orbit.enablePan = this.orbit.zoomToCursor = true;
    const { centre, half, ground, corners, signs } = this.extent;
    const whole = [...corners, ...signs.map(([, at]) => place(at))];
    const target = new Vector3(centre.x, ground, centre.z);
    direction.normalize();
    // from a distance that is enough: centre what is seen, come as close as it stays in the picture
    let distance = 6 * half;
    for (let i = 0; i < 12; i++) {
      this.lens.position.copy(target).addScaledVector(direction, distance);
      this.lens.lookAt(target);
      this.lens.updateMatrixWorld();
      this.lens.updateProjectionMatrix();
      const seen = new Box3().setFromPoints(whole.map((corner) => corner.clone().project(this.lens)));
      const { x, y } = seen.getCenter(new Vector3());
      const height = distance * Math.tan((UPRIGHT_DEG * Math.PI) / 360);
      const axes = [new Vector3(), new Vector3(), new Vector3()];
      this.lens.matrixWorld.extractBasis(axes[0], axes[1], axes[2]);
      target.addScaledVector(axes[0], x * height * this.lens.aspect);
      target.addScaledVector(axes[1], y * height);
      const size = seen.getSize(new Vector3());
      distance *= Math.max(size.x, size.y) / (2 * 0.94);
    }
    this.lens.position.copy(target).addScaledVector(direction, distance);
    this.orbit.target.copy(target);
    this.whole = distance;
    this.orbit.update();
  }
}

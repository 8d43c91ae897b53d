// The 3D scene of one flight (WebGL).

import { AmbientLight, Color, DirectionalLight, PCFShadowMap, Scene, WebGLRenderer } from "three";
import type { Flight, Moment } from "./flight";
import { ofMany } from "./marks";
import { colour } from "./palette";
import { Camera } from "./scene_camera";
import { place } from "./scene_space";
import { extentOf, terrain, type Extent } from "./scene_terrain";
import { MovingObstacles, NoReturns, Violations, Waypoints } from "./scene_things";
import { Vehicles } from "./scene_vehicles";
import { Trail } from "./trail";
import type { Pose, View } from "./view";

/** A context for a scene, or null where this browser has none. */
export function webgl(canvas: HTMLCanvasElement): WebGL2RenderingContext | null {
  return canvas.getContext("webgl2", { antialias: true, powerPreference: "low-power" });
}

export class SceneView implements View {
  private readonly renderer: WebGLRenderer;
  private readonly extent: Extent;
  private readonly camera: Camera;
  private scene!: Scene;
  private vehicles!: Vehicles;
  private waypoints!: Waypoints;
  private moving!: MovingObstacles;
  private violations!: Violations;
  private noReturns!: NoReturns;
  private trail: Trail;
  private ghost: Flight | null = null;
  private ghosts: Vehicles | null = null;
  private followed: number | null = null;
  private framed: "overview" | "top" | null = "overview";

  /**
   * @param moved the camera has moved: draw again, and let the other flight's camera follow
   */
  constructor(
    readonly canvas: HTMLCanvasElement,
    context: WebGL2RenderingContext,
    private readonly flight: Flight,
    moved: (pose: Pose | null) => void,
  ) {
    this.trail = new Trail("uas", [flight]);
    this.renderer = new WebGLRenderer({ canvas, context });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.renderer.shadowMap.autoUpdate = false;
    this.extent = extentOf(flight.scene);
    this.camera = new Camera(canvas, this.extent, () => {
      if (this.camera.byHand) this.framed = null;
      moved(this.camera.byHand ? this.camera.pose : null);
    });
    this.repaint();
  }

  draw(moment: Moment, time: number): void {
    const positions = moment.vehicles.map(({ position }) => place(position));
    this.camera.follow(this.followed === null ? null : positions[this.followed]);
    const { lens } = this.camera;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    // marks are smaller in a small picture
    const size = Math.min(1, Math.max(0.6, Math.min(width, 1.3 * height) / 800));
    const pixel = (size * 2 * Math.tan((lens.fov * Math.PI) / 360)) / height;
    const crowded = pixel * (this.followed === null ? ofMany(this.flight.uas) : 1);
    this.vehicles.draw(moment, crowded, (i) => lens.position.distanceTo(positions[i]));
    const other = this.ghost?.moment(time);
    const away = (i: number) => lens.position.distanceTo(place(other!.vehicles[i].position));
    if (other) this.ghosts?.draw(other, crowded, away);
    this.waypoints.draw(moment);
    this.moving.draw(moment, pixel);
    this.violations.draw(moment, pixel);
    this.noReturns.draw(moment, pixel, this.followed);
    this.renderer.render(this.scene, lens);
  }

  resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.lens.aspect = width / Math.max(1, height);
    this.camera.lens.updateProjectionMatrix();
    // a picture that nobody has moved by hand is framed anew
    if (this.framed) this.camera[this.framed]();
  }

  repaint(): void {
    this.scene?.traverse((part) => {
      const { geometry, material } = part as unknown as Record<string, { dispose?(): void }>;
      geometry?.dispose?.();
      material?.dispose?.();
    });
    const { ground, half, centre } = this.extent;
    this.scene = new Scene();
    this.scene.background = new Color(colour("--outside"));
    this.vehicles = new Vehicles(this.flight, ground);
    this.vehicles.setTrail(this.trail);
    this.waypoints = new Waypoints(this.flight, ground);
    this.moving = new MovingObstacles(this.flight);
    this.violations = new Violations(this.flight);
    this.noReturns = new NoReturns(this.flight);
    this.ghosts = this.ghost && new Vehicles(this.ghost, ground, true);
    this.ghosts?.setTrail(this.trail);
    if (this.ghosts) this.scene.add(this.ghosts.group);
    this.scene.add(
      terrain(this.flight.scene, this.extent),
      this.waypoints.group,
      this.moving.group,
      this.vehicles.group,
      this.violations.group,
      this.noReturns.group,
      new AmbientLight("#ffffff", 1.65),
      sun(centre.x, ground, centre.z, half),
    );
    this.renderer.shadowMap.needsUpdate = true;
  }

  follow(uas: number | null): void {
    this.followed = uas;
    if (uas !== null) this.framed = null;
  }

  setTrail(trail: Trail): void {
    this.trail = trail;
    this.vehicles.setTrail(trail);
    this.ghosts?.setTrail(trail);
  }

  setGhost(ghost: Flight | null): void {
    if (ghost === this.ghost) return;
    this.ghost = ghost;
    this.repaint();
  }

  overview(): void {
    this.followed = null;
    this.framed = "overview";
    this.camera.overview();
  }

  top(): void {
    this.followed = null;
    this.framed = "top";
    this.camera.top();
  }

  take(pose: Pose): void {
    this.framed = null;
    this.camera.take(pose);
  }
}

/** Light from the north-west, the common direction on maps. */
function sun(x: number, ground: number, z: number, half: number): DirectionalLight {
  const light = new DirectionalLight("#ffffff", 1.55);
  light.position.set(x - 0.9 * half, ground + 1.5 * half, z - 0.9 * half);
  light.target.position.set(x, ground, z);
  light.target.updateMatrixWorld();
  light.castShadow = true;
  light.shadow.mapSize.set(2048, 2048);
  light.shadow.bias = -0.0015;
  const { camera } = light.shadow;
  camera.left = camera.bottom = -1.5 * half;
  camera.right = camera.top = 1.5 * half;
  camera.near = 0.1 * half;
  camera.far = 5 * half;
  return light;
}

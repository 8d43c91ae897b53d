// The 3D scene of one flight (WebGL).

import { AmbientLight, Color, DirectionalLight, PCFShadowMap, Scene, WebGLRenderer } from "three";
import { element } from "./dom";
import type { Flight, Moment } from "./flight";
import type { Point2, Point3 } from "./flight_data";
import { words } from "./marks";
import { Overlay } from "./overlay";
import { colour } from "./palette";
import { Camera } from "./scene_camera";
import { MovingObstacles } from "./scene_moving";
import { Paths } from "./scene_paths";
import { SeenGround } from "./scene_seen";
import { place } from "./scene_space";
import { extentOf, terrain, type Extent, type Terrain } from "./scene_terrain";
import { Vehicles } from "./scene_vehicles";
import { Waypoints } from "./scene_waypoints";
import { Trail } from "./trail";
import { type Focus, NO_FOCUS, type Pose, type View } from "./view";

/** Of the pixels in each direction, while pictures are due faster than they can be drawn. */
const COARSE = 0.5;
/** Rings of charge lie around the bodies of the vehicles. */
const RINGS = 1.35;
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software/i;

/** A context for a scene, or null where this browser has none. */
export function webgl(canvas: HTMLCanvasElement): WebGL2RenderingContext | null {
  return canvas.getContext("webgl2", {
    // smooth edges cost a processor more than all else together
    antialias: !drawnByProcessor(),
    powerPreference: "low-power",
    // for pictures and films out of the page
    preserveDrawingBuffer: true,
  });
}

function drawnByProcessor(): boolean {
  const probe = document.createElement("canvas").getContext("webgl2");
  const named = probe?.getExtension("WEBGL_debug_renderer_info");
  const name = named ? String(probe!.getParameter(named.UNMASKED_RENDERER_WEBGL)) : "";
  probe?.getExtension("WEBGL_lose_context")?.loseContext();
  return SOFTWARE.test(name);
}

export class SceneView implements View {
  readonly canvases: HTMLCanvasElement[];
  private readonly over = element("canvas", { class: "over", "aria-hidden": "true" });
  private readonly pen = this.over.getContext("2d")!;
  private readonly overlay: Overlay;
  private readonly renderer: WebGLRenderer;
  private readonly extent: Extent;
  readonly camera: Camera;
  private scene!: Scene;
  private terrain!: Terrain;
  private vehicles!: Vehicles;
  private paths!: Paths;
  private waypoints!: Waypoints;
  private seen: SeenGround | null = null;
  private moving!: MovingObstacles;
  private trail: Trail;
  private ghost: Flight | null = null;
  private ghostPaths: Paths | null = null;
  private framed: "overview" | "top" | null = "overview";
  private followed: number | null = null;
  private coarse = false;

  /**
   * @param moved the camera has moved: draw again, and let the other flight's camera follow
   */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    context: WebGL2RenderingContext,
    private readonly flight: Flight,
    moved: (pose: Pose | null) => void,
  ) {
    this.canvases = [canvas, this.over];
    this.overlay = new Overlay(this.pen, flight, (point) => this.pixel(point));
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

  draw(moment: Moment, time: number, focus: Focus): void {
    const { uas } = focus;
    this.follow(uas, moment);
    const { lens } = this.camera;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    // marks are smaller in a small picture
    const size = Math.min(1, Math.max(0.6, Math.min(width, 1.3 * height) / 800));
    const pixel = (size * 2 * Math.tan((lens.fov * Math.PI) / 360)) / height;
    const { zoom } = this.camera;
    if (this.terrain.at(moment.sample)) this.renderer.shadowMap.needsUpdate = true;
    this.vehicles.draw(moment, pixel, lens.position, focus, zoom);
    this.paths.focus(focus);
    this.paths.draw(moment);
    const other = this.ghost?.moment(time);
    if (this.ghostPaths && other) {
      this.ghostPaths.focus({ ...NO_FOCUS, uas });
      this.ghostPaths.draw(other);
    }
    this.waypoints.draw(moment);
    this.seen?.draw(moment);
    this.moving.draw(moment);
    this.renderer.render(this.scene, lens);
    this.pen.clearRect(0, 0, width, height);
    for (const [text, point] of this.extent.signs) {
      const at = this.pixel(point);
      if (at) words(this.pen, text, ...at, Math.max(11, 15 * size), colour("--faint"));
    }
    this.overlay.reach(moment, focus);
    this.overlay.moving(moment, size);
    if (this.ghost && other) this.overlay.ghosts(this.ghost, other, size);
    this.overlay.draw(moment, focus, RINGS * size, zoom, false);
  }

  pixel(point: Point3): Point2 | null {
    const { x, y, z } = place(point).project(this.camera.lens);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    return z > 1 ? null : [((x + 1) / 2) * width, ((1 - y) / 2) * height];
  }

  /** Fewer pixels, where a picture takes long and the next one is due. */
  setCoarse(coarse: boolean): void {
    if (coarse === this.coarse) return;
    this.coarse = coarse;
    this.resize();
  }

  resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const ratio = Math.min(devicePixelRatio, 2);
    this.renderer.setPixelRatio(ratio * (this.coarse ? COARSE : 1));
    this.renderer.setSize(width, height, false);
    this.over.width = Math.round(width * ratio);
    this.over.height = Math.round(height * ratio);
    this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
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
    this.seen?.dispose();
    const { ground, half, centre } = this.extent;
    this.scene = new Scene();
    this.scene.background = new Color(colour("--outside"));
    this.terrain = terrain(this.flight.scene, this.extent);
    this.vehicles = new Vehicles(this.flight, ground);
    this.paths = new Paths(this.flight, false);
    this.waypoints = new Waypoints(this.flight, ground);
    this.seen = new SeenGround(this.flight, this.extent);
    this.moving = new MovingObstacles(this.flight);
    this.ghostPaths = this.ghost && new Paths(this.ghost, true);
    if (this.ghostPaths) this.scene.add(this.ghostPaths.group);
    this.setTrail(this.trail);
    this.scene.add(
      this.terrain.group,
      this.seen.group,
      this.waypoints.group,
      this.moving.group,
      this.paths.group,
      this.vehicles.group,
      new AmbientLight("#ffffff", 1.65),
      sun(centre.x, ground, centre.z, half),
    );
    this.renderer.shadowMap.needsUpdate = true;
  }

  private follow(uas: number | null, moment: Moment): void {
    const ended = uas === null && this.followed !== null;
    this.followed = uas;
    this.camera.follow(uas === null ? null : place(moment.vehicles[uas].position));
    if (uas !== null) this.framed = null;
    else if (ended && this.framed === null) this.overview();
  }

  setTrail(trail: Trail): void {
    this.trail = trail;
    this.paths.setTrail(trail);
    this.ghostPaths?.setTrail(trail);
  }

  setGhost(ghost: Flight | null): void {
    if (ghost === this.ghost) return;
    this.ghost = ghost;
    this.repaint();
  }

  overview(): void {
    this.framed = "overview";
    this.camera.overview();
  }

  top(): void {
    this.framed = "top";
    this.camera.top();
  }

  take(pose: Pose): void {
    this.framed = null;
    this.camera.take(pose);
  }

  /** A browser keeps few of these: give it back. */
  end(): void {
    this.renderer.dispose();
    this.renderer.forceContextLoss();
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

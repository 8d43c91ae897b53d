// A view draws one flight at a moment: the 3D scene, or the map where there is no WebGL.

import type { Flight, Moment } from "./flight";
import type { Point2, Point3 } from "./flight_data";
import type { Trail } from "./trail";

/** Where a 3D camera looks from: its offset from what it looks at, and that point. */
export interface Pose {
  offset: [number, number, number];
  target: [number, number, number];
}

/** What is looked at: one UAS, those of a filter, a point that was clicked. */
export interface Focus {
  uas: number | null;
  shown(i: number): boolean;
  picked: Point3 | null;
}

export const NO_FOCUS: Focus = { uas: null, shown: () => true, picked: null };

export interface View {
  /** All that is drawn, the lowest first. */
  readonly canvases: HTMLCanvasElement[];
  /** @param time of the page, which may go on after this flight has ended */
  draw(moment: Moment, time: number, focus: Focus): void;
  /** Where a point of the flight was on the last picture [px]; null: nowhere. */
  pixel(point: Point3): Point2 | null;
  /** Show the paths and vehicles of another flight too, pale; null: of none. */
  setGhost(ghost: Flight | null): void;
  /** The canvas has changed its size. */
  resize(): void;
  /** Light has become dark, or dark light, or the flight has gone on. */
  repaint(): void;
  /** Colour the paths flown. */
  setTrail(trail: Trail): void;
  overview(): void;
  top(): void;
}

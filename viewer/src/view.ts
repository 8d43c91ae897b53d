// A view draws one flight at a moment: the 3D scene, or the map where there is no WebGL.

import type { Flight, Moment } from "./flight";
import type { Trail } from "./trail";

/** Where a 3D camera looks from: its offset from what it looks at, and that point. */
export interface Pose {
  offset: [number, number, number];
  target: [number, number, number];
}

export interface View {
  readonly canvas: HTMLCanvasElement;
  /** @param time of the page, which may go on after this flight has ended */
  draw(moment: Moment, time: number): void;
  /** Show the paths and vehicles of another flight too, pale; null: of none. */
  setGhost(ghost: Flight | null): void;
  /** The canvas has changed its size. */
  resize(): void;
  /** Light has become dark, or dark light. */
  repaint(): void;
  /** Keep a UAS in the middle; null: the whole area. */
  follow(uas: number | null): void;
  /** Colour the paths flown. */
  setTrail(trail: Trail): void;
  overview(): void;
  top(): void;
}

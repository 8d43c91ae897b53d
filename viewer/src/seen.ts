// The ground that cameras have seen, painted picture by picture: a sheet for each kind of camera,
// north up, over the box around the fence.

import { bounds } from "./bounds";
import type { Flight } from "./flight";
import type { Point2 } from "./flight_data";

/** Of a sheet's longer side [px]. */
const SIDE_PX = 1024;
/** How much a sheet hides of what is under it. */
export const SEEN_ALPHA = 0.38;

export class SeenSheet {
  readonly canvas = document.createElement("canvas");
  private readonly pen = this.canvas.getContext("2d")!;
  private readonly scale: number;
  private painted = 0;

  constructor(
    private readonly flight: Flight,
    private readonly n: number,
    private readonly low: Point2,
    private readonly high: Point2,
  ) {
    const [high_m, wide_m] = [high[0] - low[0], high[1] - low[1]];
    this.scale = SIDE_PX / Math.max(high_m, wide_m);
    this.canvas.width = Math.max(1, Math.round(wide_m * this.scale));
    this.canvas.height = Math.max(1, Math.round(high_m * this.scale));
  }

  /** Hold what was seen until a sample; says whether anything has changed. */
  until(sample: number): boolean {
    // the flight may have gone on: what was painted stays the beginning of it
    const { sample: taken, corners, colour } = this.flight.data.seen[this.n];
    let due = this.painted;
    while (due < taken.length && taken[due] <= sample) due++;
    while (due > 0 && taken[due - 1] > sample) due--;
    if (due === this.painted) return false;
    const { pen, canvas } = this;
    if (due < this.painted) {
      pen.clearRect(0, 0, canvas.width, canvas.height);
      this.painted = 0;
    }
    pen.fillStyle = colour;
    for (; this.painted < due; this.painted++) {
      pen.beginPath();
      for (let corner = 0; corner < 4; corner++) {
        const at = 2 * (4 * this.painted + corner);
        const [north, east] = [corners.values[at] * corners.unit, corners.values[at + 1] * corners.unit];
        pen.lineTo((east - this.low[1]) * this.scale, (this.high[0] - north) * this.scale);
      }
      pen.fill();
    }
    return true;
  }
}

/** The sheets of a flight, none where no UAS carries a camera. */
export function sheets(flight: Flight): SeenSheet[] {
  const [low, high] = bounds(flight.scene.fence.outline);
  return flight.data.seen.map((_, n) => new SeenSheet(flight, n, low, high));
}

// Of many curves what lies between the least and the greatest, and the one in the middle.

/** What its curves are. */
export const BAND_WORDS = "least, median";

export interface Band {
  least: number[];
  median: number[];
  greatest: number[];
}

/** What has ended stays where it ended. */
export function bandOf(curves: number[][]): Band {
  const samples = Math.max(...curves.map((values) => values.length));
  const band: Band = { least: [], median: [], greatest: [] };
  for (let k = 0; k < samples; k++) {
    const sorted = curves
      .map((values) => values[Math.min(k, values.length - 1)])
      .sort((a, b) => a - b);
    band.least.push(sorted[0]);
    band.median.push(sorted[Math.round(0.5 * (sorted.length - 1))]);
    band.greatest.push(sorted.at(-1)!);
  }
  return band;
}

/** Paint it. */
export function drawBand(
  pen: CanvasRenderingContext2D,
  band: Band,
  ink: string,
  x: (sample: number) => number,
  y: (value: number) => number,
): void {
  const { least, median, greatest } = band;
  pen.fillStyle = pen.strokeStyle = ink;
  pen.setLineDash([]);
  pen.globalAlpha = 0.2;
  pen.beginPath();
  least.forEach((value, k) => pen.lineTo(x(k), y(value)));
  for (let k = greatest.length - 1; k >= 0; k--) pen.lineTo(x(k), y(greatest[k]));
  pen.fill();
  pen.globalAlpha = 1;
  for (const [values, width] of [
    [least, 1.6],
    [median, 1],
  ] as const) {
    pen.lineWidth = width;
    pen.beginPath();
    values.forEach((value, k) => pen.lineTo(x(k), y(value)));
    pen.stroke();
  }
}

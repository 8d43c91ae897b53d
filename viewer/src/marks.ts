// What stands for a waypoint, a vehicle, a violation: drawn alike on the map and over the 3D
// scene. What has a meaning has a shape, not only a colour.

import { bright, colour, legible, ofSpare } from "./palette";

type Pen = CanvasRenderingContext2D;

/** A ring while open; filled and ticked once covered; two rings for more weight. */
export function waypoint(
  pen: Pen,
  x: number,
  y: number,
  radius: number,
  unit: number,
  heavy: boolean,
  covered: boolean,
): void {
  pen.lineWidth = 1.4 * unit;
  pen.strokeStyle = colour(covered ? "--covered-edge" : "--open");
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  if (covered) {
    pen.globalAlpha = 0.45;
    pen.fillStyle = colour("--covered");
    pen.fill();
    pen.globalAlpha = 1;
  }
  pen.stroke();
  if (heavy && radius > 5 * unit) {
    pen.beginPath();
    pen.arc(x, y, radius - 3.5 * unit, 0, 2 * Math.PI);
    pen.stroke();
  }
  if (covered) {
    const tick = Math.min(radius, 12 * unit) * 0.5;
    pen.lineWidth = 2 * unit;
    pen.beginPath();
    pen.moveTo(x - tick, y);
    pen.lineTo(x - 0.25 * tick, y + 0.7 * tick);
    pen.lineTo(x + tick, y - 0.7 * tick);
    pen.stroke();
  }
}

/** The ring that is as long as the charge, with a notch where it is needed for home. */
export function charge(
  pen: Pen,
  x: number,
  y: number,
  radius: number,
  soc: number,
  spare: number,
): void {
  const whole = 2 * Math.PI;
  pen.lineCap = "butt";
  ring(pen, x, y, radius, whole, 0.36 * radius, colour("--halo"));
  ring(pen, x, y, radius, whole, 0.08 * radius, colour("--faint"));
  ring(pen, x, y, radius, whole * Math.min(1, Math.max(0, soc)), 0.26 * radius, ofSpare(spare));
  const needed = whole * Math.min(1, Math.max(0, soc - spare)) - Math.PI / 2;
  const [dx, dy] = [Math.cos(needed), Math.sin(needed)];
  const [from, to] = [0.8 * radius, 1.25 * radius];
  stroke(pen, x + from * dx, y + from * dy, x + to * dx, y + to * dy, 0.16 * radius, colour("--ink"));
}

function ring(
  pen: Pen,
  x: number,
  y: number,
  radius: number,
  angle: number,
  width: number,
  stroke: string,
): void {
  pen.lineWidth = width;
  pen.strokeStyle = stroke;
  pen.beginPath();
  pen.arc(x, y, radius, -Math.PI / 2, angle - Math.PI / 2);
  pen.stroke();
}

/** A cross turned to the heading, its nose in the colour of the UAS. */
export function vehicle(
  pen: Pen,
  x: number,
  y: number,
  arm: number,
  heading: number,
  hex: string,
): void {
  pen.lineCap = "round";
  for (const turned of [Math.PI / 4, -Math.PI / 4]) {
    const [dx, dy] = [arm * Math.sin(heading + turned), -arm * Math.cos(heading + turned)];
    stroke(pen, x - dx, y - dy, x + dx, y + dy, 0.32 * arm, colour("--ink"));
  }
  const nose = [x + arm * Math.sin(heading), y - arm * Math.cos(heading)];
  stroke(pen, x, y, nose[0], nose[1], 0.32 * arm, bright(hex));
}

export function landed(pen: Pen, x: number, y: number, radius: number, hex: string): void {
  pen.fillStyle = bright(hex);
  pen.strokeStyle = colour("--halo");
  pen.lineWidth = 0.35 * radius;
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fill();
  pen.stroke();
}

/** A UAS of another flight: a thin ring, its number with a stroke. */
export function ghost(pen: Pen, x: number, y: number, radius: number, label: string, hex: string): void {
  pen.globalAlpha = 0.75;
  ring(pen, x, y, radius, 2 * Math.PI, 0.16 * radius, bright(hex));
  pen.globalAlpha = 1;
  words(pen, `${label}′`, x + 1.2 * radius, y + 1.1 * radius, Math.max(11, 0.9 * radius), legible(hex));
}

/** A red cross: a UAS that is lost, or a violation. */
export function cross(pen: Pen, x: number, y: number, arm: number): void {
  for (const [width, ink] of [
    [0.75, colour("--halo")],
    [0.42, colour("--discharged")],
  ] as const) {
    pen.lineCap = "butt";
    stroke(pen, x - arm, y - arm, x + arm, y + arm, width * arm, ink);
    stroke(pen, x - arm, y + arm, x + arm, y - arm, width * arm, ink);
  }
}

/** A contact: a cross in a ring. */
export function violation(pen: Pen, x: number, y: number, arm: number): void {
  cross(pen, x, y, arm);
  ring(pen, x, y, 2.1 * arm, 2 * Math.PI, 0.3 * arm, colour("--discharged"));
}

/** A diamond where least charge was left beyond the way home; filled: the point of no return. */
export function noReturn(pen: Pen, x: number, y: number, arm: number, passed: boolean, hex: string): void {
  pen.beginPath();
  pen.moveTo(x, y - arm);
  pen.lineTo(x + arm, y);
  pen.lineTo(x, y + arm);
  pen.lineTo(x - arm, y);
  pen.closePath();
  pen.fillStyle = passed ? colour("--discharged") : colour("--halo");
  pen.strokeStyle = passed ? colour("--ink") : bright(hex);
  pen.lineWidth = 0.3 * arm;
  pen.fill();
  pen.stroke();
}

/** Words with an edge that keeps them readable on any ground. */
export function words(
  pen: Pen,
  text: string,
  x: number,
  y: number,
  size: number,
  ink: string,
  align: CanvasTextAlign = "center",
  weight = 600,
): void {
  pen.font = `${weight} ${size}px system-ui, sans-serif`;
  pen.textAlign = align;
  pen.textBaseline = "middle";
  pen.lineJoin = "round";
  pen.lineWidth = 0.3 * size;
  pen.strokeStyle = colour("--halo");
  pen.strokeText(text, x, y);
  pen.fillStyle = ink;
  pen.fillText(text, x, y);
}

export function stroke(
  pen: Pen,
  x1: number,
  y1: number,
  x2: number,
  y2: number,
  width: number,
  ink: string,
): void {
  pen.lineWidth = width;
  pen.strokeStyle = ink;
  pen.beginPath();
  pen.moveTo(x1, y1);
  pen.lineTo(x2, y2);
  pen.stroke();
}

/** Marks of many UAS are smaller, so that they do not hide each other and the waypoints. */
function ofMany(uas: number): number {
  return Math.max(0.4, Math.min(1, Math.sqrt(8 / uas)));
}

/** Of many, those beside the one that is followed stay smaller than it. */
const BESIDE = 0.6;

/** Size of the marks of a UAS that is not followed: of many smaller, and whole again from near. */
export function crowded(uas: number, zoom: number, oneIsFollowed: boolean): number {
  const share = ofMany(uas);
  const most = oneIsFollowed ? Math.max(BESIDE, share) : 1;
  return Math.min(most, share * Math.max(1, zoom));
}

/** What a UAS is called on the map: the end of its name. */
export function shortName(name: string): string {
  return name.split("_").at(-1)!.slice(0, 3);
}

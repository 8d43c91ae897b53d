// The curves beside a flight. Two flights share their ranges, so that they can be compared.

import { Chart, DASHES, type ChartContent, type Line, type TimeCanvas } from "./chart";
import type { Flight } from "./flight";
import type { Series } from "./flight_data";
import { shortName } from "./marks";
import { ModeChart } from "./mode_chart";
import { colour } from "./palette";

const FEW = 4;

export function curves(
  flight: Flight,
  all: Flight[],
  duration: number,
  seek: (time: number) => void,
): TimeCanvas[] {
  const cameras = all.some((each) => each.data.seen.length > 0);
  const contents = (each: Flight, focused: number | null = null) => [
    charge(each, focused),
    room(each, focused),
    voltage(each),
    current(each),
    coverage(each),
    ...(cameras ? [ground(each)] : []),
  ];
  const decisions = all.some((each) => each.data.duration.values.length > 0);
  const charts = contents(flight).map((_, i) => {
    const shared = all.flatMap((each) => values(contents(each)[i]));
    const of = (focused: number | null) => widened(contents(flight, focused)[i], shared);
    return new Chart(of, duration, seek);
  });
  const modes = new ModeChart(flight, duration, seek);
  if (!decisions) return [...charts, modes];
  // the first decision often plans all of the mission, or loads what is compiled: it is not the scale
  const later = all.flatMap(({ data: { duration } }) => {
    const { values: whole, unit } = duration;
    return (whole.length > 1 ? whole.slice(1) : whole).map((value) => value * unit);
  });
  const longest_s = later.reduce((a, b) => Math.max(a, b), 0);
  const [unit, scale] = longest_s < 0.1 ? ["ms", 1000] : ["s", 1];
  const content = (each: Flight) => decisionTime(each, unit as string, scale as number, longest_s);
  return [...charts, modes, new Chart(() => content(flight), duration, seek)];
}

/** Charge, and what of it the way home takes with margin: where they meet is no return. */
function charge(flight: Flight, focused: number | null): ChartContent {
  const floors = new Set(flight.scene.uas.map((uas) => uas.lowest_soc));
  const looked = (i: number) => (focused === null ? flight.uas <= FEW : i === focused);
  const needed = lines(flight, flight.data.needed, 100)
    .filter((line) => looked(line.uas!))
    .map((line) => ({ ...line, dash: [1.5, 2.5], limit: true }));
  const points = flight.scene.uas.flatMap(({ colour }, i) => {
    const passed = flight.data.no_return[i];
    if (!flight.nearNoReturn(i, focused)) return [];
    const [least, spare] = flight.data.least_spare[i];
    const sample = passed ?? least;
    const value = 100 * flight.column(flight.data.soc, i)[sample];
    const words = passed === null ? `${(100 * spare).toFixed(1)} % to spare` : "no return";
    return [{ sample, value, serious: passed !== null, colour, words }];
  });
  return {
    title: `Charge, %${needed.length > 0 ? "; dotted: for home" : ""}`,
    lines: [...lines(flight, flight.data.soc, 100), ...needed],
    points,
    dt: flight.data.dt_s,
    show: (value) => `${value.toFixed(1)} %`,
    from: 0,
    to: 100,
    levels: [...floors].map((floor) => [100 * floor, "lowest allowed"]),
  };
}

/** [words, custom property of the style, dashes] */
const ROOMS: Record<string, [string, string, number[]]> = {
  obstacles: ["obstacles", "--near-obstacles", []],
  moving: ["moving", "--near-moving", [6, 3]],
  others: ["UAS", "--near-others", [2, 3]],
  fence: ["fence", "--near-fence", [9, 3, 2, 3]],
  height: ["height", "--near-height", [4, 2]],
};
const NEAR_M = 20;

/** Room beyond the safe distances of what is nearest: of one UAS, or the least of all. */
function room(flight: Flight, focused: number | null): ChartContent {
  const uas = flight.scene.uas.map((_, i) => i).filter((i) => focused === null || i === focused);
  const kinds = Object.entries(flight.data.room);
  return {
    title: "Room, m",
    lines: kinds.map(([kind, { values: whole, unit }]) => ({
      label: "",
      colour: colour(ROOMS[kind][1]),
      values: Array.from(
        { length: Math.max(...uas.map((i) => flight.data.last[i])) + 1 },
        (_, k) => Math.min(...uas.map((i) => whole[k * flight.uas + i] * unit)),
      ),
      dash: ROOMS[kind][2],
    })),
    legend: kinds.map(([kind]) => [ROOMS[kind][0], colour(ROOMS[kind][1])]),
    dt: flight.data.dt_s,
    show: (value) => (value >= NEAR_M ? "far" : value.toFixed(1)),
    from: -1,
    to: NEAR_M,
    levels: [[0, "safe distance"]],
    clipped: true,
  };
}

function voltage(flight: Flight): ChartContent {
  return {
    title: "Voltage, V",
    lines: lines(flight, flight.data.voltage, 1),
    dt: flight.data.dt_s,
    show: (value) => `${value.toFixed(2)} V`,
  };
}

function current(flight: Flight): ChartContent {
  return {
    title: "Current, A",
    lines: lines(flight, flight.data.current, 1),
    dt: flight.data.dt_s,
    show: (value) => `${value.toFixed(1)} A`,
    from: 0,
  };
}

function coverage(flight: Flight): ChartContent {
  const count = flight.askedFor(flight.data.samples - 1);
  return {
    title: "Waypoints covered",
    lines: [{ label: "", colour: colour("--progress"), values: flight.data.covered, dash: [] }],
    dt: flight.data.dt_s,
    show: (value) => `${value} of ${count}`,
    from: 0,
    to: count,
    steps: true,
  };
}

/** Of the ground to be seen, how much each kind of camera has. */
function ground(flight: Flight): ChartContent {
  const { seen } = flight.data;
  const one = seen.length === 1;
  return {
    title: `Ground seen, %${one ? ` (${seen[0].sensor})` : ""}`,
    lines: seen.map(({ share, colour }, n) => ({
      label: "",
      colour,
      values: share.values.map((value) => 100 * value * share.unit),
      dash: DASHES[n % DASHES.length],
    })),
    legend: one ? undefined : seen.map(({ sensor, colour }) => [sensor, colour]),
    dt: flight.data.dt_s,
    show: (value) => `${value.toFixed(0)} %`,
    from: 0,
    to: 100,
    steps: true,
  };
}

function decisionTime(flight: Flight, unit: string, scale: number, longest_s: number): ChartContent {
  const { values: whole, unit: step } = flight.data.duration;
  const { fallbacks } = flight.data;
  return {
    title: `Decision time, ${unit}${fallbacks.length > 0 ? ` (■ fallbacks: ${fallbacks.length})` : ""}`,
    lines: [
      { label: "", colour: colour("--effort"), values: whole.map((value) => value * step * scale), dash: [] },
    ],
    dt: flight.data.dt_s,
    show: (value) => `${value.toFixed(2)} ${unit}`,
    from: 0,
    to: longest_s * scale,
    clipped: true,
    marked: fallbacks,
  };
}

function lines(flight: Flight, series: Series, scale: number): Line[] {
  return flight.scene.uas.map((uas, i) => ({
    label: shortName(uas.name),
    colour: uas.colour,
    values: flight.column(series, i).map((value) => value * scale),
    dash: DASHES[i % DASHES.length],
    uas: i,
  }));
}

function values(content: ChartContent): number[] {
  return content.lines.flatMap((line) => line.values);
}

function widened(content: ChartContent, shared: number[]): ChartContent {
  if (content.clipped) shared = shared.filter((value) => value <= content.to!);
  return {
    ...content,
    from: shared.reduce((a, b) => Math.min(a, b), content.from ?? Infinity),
    to: shared.reduce((a, b) => Math.max(a, b), content.to ?? -Infinity),
  };
}

// The curves beside a flight. Two flights share their ranges, so that they can be compared.

import { Chart, DASHES, type ChartContent, type Line, type TimeCanvas } from "./chart";
import type { Flight, Series } from "./flight";
import { shortName } from "./marks";
import { ModeChart } from "./mode_chart";

export function curves(
  flight: Flight,
  all: Flight[],
  duration: number,
  seek: (time: number) => void,
): TimeCanvas[] {
  const contents = (each: Flight) => [charge(each), voltage(each), current(each), coverage(each)];
  const decisions = all.some((each) => each.data.duration.values.length > 0);
  const charts = contents(flight).map((content, i) => {
    const shared = all.flatMap((each) => values(contents(each)[i]));
    return new Chart(widened(content, shared), duration, seek);
  });
  const modes = new ModeChart(flight, duration, seek);
  if (!decisions) return [...charts, modes];
  const longest = all
    .flatMap((each) => each.data.duration.values)
    .reduce((a, b) => Math.max(a, b), 0);
  const [unit, scale] = longest * all[0].data.duration.unit < 0.1 ? ["ms", 1000] : ["s", 1];
  const content = (each: Flight) => decisionTime(each, unit as string, scale as number);
  const shared = all.flatMap((each) => values(content(each)));
  return [...charts, modes, new Chart(widened(content(flight), shared), duration, seek)];
}

function charge(flight: Flight): ChartContent {
  const floors = new Set(flight.scene.uas.map((uas) => uas.lowest_soc));
  return {
    title: "Charge, %",
    lines: lines(flight, flight.data.soc, 100),
    dt: flight.data.dt_s,
    show: (value) => `${value.toFixed(1)} %`,
    from: 0,
    to: 100,
    levels: [...floors].map((floor) => [100 * floor, "lowest allowed"]),
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
  const count = flight.scene.waypoints.length;
  return {
    title: "Waypoints covered",
    lines: [{ label: "", colour: "#009e73", values: flight.data.covered, dash: [] }],
    dt: flight.data.dt_s,
    show: (value) => `${value} of ${count}`,
    from: 0,
    to: count,
    steps: true,
  };
}

function decisionTime(flight: Flight, unit: string, scale: number): ChartContent {
  const { values: whole, unit: step } = flight.data.duration;
  const { fallbacks } = flight.data;
  return {
    title: `Decision time, ${unit}${fallbacks.length > 0 ? ` (■ fallbacks: ${fallbacks.length})` : ""}`,
    lines: [
      { label: "", colour: "#aa4b8c", values: whole.map((value) => value * step * scale), dash: [] },
    ],
    dt: flight.data.dt_s,
    show: (value) => `${value.toFixed(2)} ${unit}`,
    from: 0,
    marked: fallbacks,
  };
}

function lines(flight: Flight, series: Series, scale: number): Line[] {
  return flight.scene.uas.map((uas, i) => ({
    label: shortName(uas.name),
    colour: uas.colour,
    values: flight.column(series, i).map((value) => value * scale),
    dash: DASHES[i % DASHES.length],
  }));
}

function values(content: ChartContent): number[] {
  return content.lines.flatMap((line) => line.values);
}

function widened(content: ChartContent, shared: number[]): ChartContent {
  return {
    ...content,
    from: shared.reduce((a, b) => Math.min(a, b), content.from ?? Infinity),
    to: shared.reduce((a, b) => Math.max(a, b), content.to ?? -Infinity),
  };
}

// A flight of two UAS over three samples, one of which is lost at the second.

import type { FlightData } from "../src/flight_data";

export function someFlight(): FlightData {
  const body = { corners: [], triangles: [], outline: [] };
  const series = (unit: number, values: number[]) => ({ unit, values });
  return {
    planner: "hover",
    seed: 0,
    dynamics: "lpv",
    dt_s: 0.5,
    samples: 3,
    scene: {
      name: "yard",
      fence: body,
      obstacles: [],
      decorations: [],
      waypoints: [],
      moving: [{ name: "balloon", kind: "balloon", radius: 1, height: 2, safe: 3, from: 0 }],
      uas: [
        { name: "uas_1", colour: "#000000", homes: [{ from: 0, at: [0, 0, 0] }], lowest_soc: 0.2 },
        { name: "uas_2", colour: "#ffffff", homes: [{ from: 0, at: [5, 0, 0] }], lowest_soc: 0.2 },
      ],
    },
    position: series(0.01, [
      ...[0, 0, 0, 500, 0, 0],
      ...[100, 200, -300, 500, 100, 0],
      ...[300, 200, -300, 500, 100, 0],
    ]),
    attitude: series(0.001, new Array(18).fill(0)),
    soc: series(0.0001, [10000, 9000, 9900, 8900, 9700, 8900]),
    needed: series(0.0001, [2000, 3000, 2500, 2000, 9800, 2000]),
    floor: series(0.1, [0, 0, 20, 0, 0, 0]),
    reach: [
      {
        from: 0,
        north: [-50, 50, 3],
        east: [-50, 50, 3],
        height: 3,
        needed: series(0.0001, new Array(18).fill(2000)),
        per_m: [0.01, 0.01],
        fixed: [0, 0],
      },
    ],
    seen: [],
    room: { fence: series(0.01, [500, 500, 100, -20, 400, 5000]) },
    min_height_m: 3,
    no_return: [2, null],
    least_spare: [
      [2, -0.01],
      [0, 0.6],
    ],
    marks: [{ t_s: 0.5, until_s: 1, kind: "breach", uas: "uas_2", text: "too near" }],
    // of 15 V and 10 A, half a second a sample
    energy: series((150 * 0.5) / 3600, [0, 0, 1, 1, 2, 2]),
    voltage: series(0.001, new Array(6).fill(15000)),
    current: series(0.01, new Array(6).fill(1000)),
    moving: series(0.01, [0, 0, -1000, 0, 100, -1000, 0, 300, -1000]),
    duration: series(0.00001, [10, 20]),
    modes: ["covering", "transit", "return", "landed", "lost"],
    mode_runs: [
      [
        [0, 0, 2],
        [1, 2, 2],
      ],
      [
        [0, 0, 1],
        [4, 1, 2],
      ],
    ],
    last: [2, 1],
    covered: [0, 1, 1],
    covered_at: [1],
    fallbacks: [],
    plan: { unit: 0.1, steps: [[[10, 20, 30], []], []] },
    violations: [{ t_s: 0.5, uas: "uas_2", kind: "geofence", with: null }],
    figures: [["steps", "2"]],
    summary: { steps: 2, energy_Wh: 1, all_home: false, breaches: 0 },
  };
}

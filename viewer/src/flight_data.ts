// A flight as the page holds it: uas_coverage_env/replay/flight_data.py writes it. Frame: NED in
// metres; angles in radians.

export type Point2 = [number, number];
export type Point3 = [number, number, number];

export interface Series {
  unit: number;
  values: number[];
}

export interface Body {
  corners: Point3[];
  triangles: Point3[];
  outline: Point2[];
}

export interface Obstacle extends Body {
  name: string;
  kind: string;
  colour: string;
  /** Sample from which it stands: events add some. */
  from: number;
  /** Above a doorway: on the map its outline alone, so that the door is seen. */
  overhead?: boolean;
}

/** Where a UAS is to land, from a sample on. */
export interface Home {
  from: number;
  at: Point3;
}

export interface Scene {
  name: string;
  fence: Body;
  obstacles: Obstacle[];
  decorations: { kind: string; colour: string; outline: Point2[] }[];
  /** To be covered from a sample on; `until` when it was dropped, if it was. */
  waypoints: { at: Point3; radius: number; heavy: boolean; from: number; until: number | null }[];
  moving: { name: string; kind: string; radius: number; height: number; safe: number; from: number }[];
  uas: { name: string; colour: string; homes: Home[]; lowest_soc: number }[];
}

export interface Violation {
  t_s: number;
  uas: string;
  kind: string;
  with: string | null;
  value?: number;
  limit?: number;
}

/** What happened, and why; it may last. Violations are apart. */
export interface Mark {
  t_s: number;
  until_s: number;
  kind: string;
  uas: string | null;
  text: string;
}

/** What reaching a place and coming home from it takes (reach_data.py), on a grid. */
export interface ReachData {
  /** Sample from which it holds: until obstacles or homes are others. */
  from: number;
  /** Low end [m], step [m], count. */
  north: [number, number, number];
  east: [number, number, number];
  /** Above the origin [m]. */
  height: number;
  /** Charge below which coming home is not sure: axes UAS, north, east. */
  needed: Series;
  /** Charge of a metre of flight there, and of slowing down, by UAS. */
  per_m: number[];
  fixed: number[];
}

/** What a kind of camera has seen: the pictures that showed new ground, in order of time. */
export interface SeenData {
  sensor: string;
  colour: string;
  sample: number[];
  /** North, east of four corners each. */
  corners: Series;
  /** Of the ground to be seen, at each sample. */
  share: Series;
}

export interface FlightData {
  planner: string;
  seed: number;
  dynamics: string;
  dt_s: number;
  samples: number;
  scene: Scene;
  position: Series;
  attitude: Series;
  soc: Series;
  /** Charge below which coming home is not sure. */
  needed: Series;
  /** Altitude of the roof, or the ground, under each UAS. */
  floor: Series;
  reach: ReachData[];
  seen: SeenData[];
  /** Room beyond the safe distances by kind of what is near. */
  room: Record<string, Series>;
  min_height_m: number;
  /** Sample of the point of no return of each UAS, where it was passed. */
  no_return: (number | null)[];
  /** Of each UAS the sample with the least charge beyond the way home, and that charge. */
  least_spare: [number, number][];
  marks: Mark[];
  /** What each UAS has drawn until a sample [Wh]. */
  energy: Series;
  voltage: Series;
  current: Series;
  moving: Series;
  duration: Series;
  modes: string[];
  /** Of each UAS in order of time: mode, first sample, sample at which the next one begins. */
  mode_runs: [number, number, number][][];
  last: number[];
  covered: number[];
  covered_at: number[];
  fallbacks: number[];
  plan: { unit: number; steps: number[][][] };
  violations: Violation[];
  /** Heading and text of each figure of the flight, as `show` prints them. */
  figures: [string, string][];
  summary: {
    steps: number;
    energy_Wh: number;
    all_home: boolean;
    breaches: number;
  };
}

// Axes of charts: between pixels and values, and the round numbers that stand beside them.
"use strict";
const pyroshockAxes = (() => {
  const superscript = (exponent) =>
    [...String(exponent)].map((sign) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(sign)]).join("");
  const words = (value, digits = 4) => {
    if (value === null || !Number.isFinite(value)) return "–";
    const size = Math.abs(value);
    if (size && (size >= 1e7 || size < 1e-4)) {
      const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
      return `${Number(mantissa)}×10${superscript(Number(exponent))}`.replace("-", "−");
    }
    return Number(value.toPrecision(digits)).toString().replace("-", "−");
  };
  const finite = (value) => value !== null && Number.isFinite(value);

  // An axis between two pixels: `at` gives the pixel of a value, `back` the value of a pixel.
  const scaleOf = (axis, from, to, [low, high]) => {
    const log = axis.scale === "log",
      forth = log ? Math.log10 : Number,
      back = log ? (v) => 10 ** v : Number;
    const [a, b] = axis.reversed ? [to, from] : [from, to],
      start = forth(low),
      span = forth(high) - start || 1;
    return {
      axis,
      low,
      high,
      at: (value) => {
        if (value === null) return NaN;
        return Math.max(-1e5, Math.min(1e5, a + ((forth(value) - start) / span) * (b - a)));
      },
      back: (pixel) => back(start + ((pixel - a) / (b - a)) * span),
    };
  };
  // A scale shows at least so many numbers where there is room for them.
  const LEAST = 3;
  const superscripted = (value) => `10${superscript(Math.round(Math.log10(value)))}`;

  // Multiples of a step of 1, 2 or 5 times a power of ten: the coarsest that names `need` numbers.
  const evenTicks = (axis, low, high, most, need) => {
    const rough = (high - low) / Math.max(1, most),
      power = 10 ** Math.floor(Math.log10(rough));
    const multiples = (step) => {
      const digits = Math.max(
          4,
          Math.ceil(Math.log10(Math.max(Math.abs(low), Math.abs(high)) / step)) + 2,
        ),
        ticks = [];
      for (let k = Math.ceil(low / step - 1e-9); k <= Math.floor(high / step + 1e-9); k += 1)
        ticks.push([k * step, words(k * step, digits)]);
      return ticks;
    };
    const steps = [10, 5, 2, 1, 0.5, 0.2, 0.1]
      .map((factor) => factor * power)
      .filter((step) => step <= 10 * power && (!axis.whole || step >= 1));
    const coarsest = steps.filter((step) => step >= rough * (1 - 1e-9)).pop() || 10 * power;
    let ticks = multiples(axis.whole ? Math.max(1, Math.round(coarsest)) : coarsest);
    for (const step of steps.filter((finer) => finer < coarsest)) {
      if (ticks.length >= need) break;
      const finer = multiples(step);
      ticks = finer.length > most + 1 ? finer.filter((_, i) => i % 2 === 0) : finer;
    }
    return ticks;
  };

  // 1, 2 and 5 of each decade, or where there is no room for them the powers of ten; null within a
  // part of a decade that has too few of both.
  const decadeTicks = (low, high, most, need) => {
    const decades = [],
      first = Math.floor(Math.log10(low)),
      last = Math.ceil(Math.log10(high));
    for (let k = first; k <= last; k += 1) decades.push(k);
    const inside = (values) =>
      values.filter((value) => value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9));
    const fine = inside(decades.flatMap((k) => [1, 2, 5].map((m) => Number(`${m}e${k}`))));
    const powers = inside(decades.map((k) => Number(`1e${k}`)));
    if (fine.length < need) return null;
    if (fine.length <= most) return fine.map((value) => [value, words(value)]);
    const sparse = powers.length >= need ? powers : fine,
      step = Math.max(1, Math.min(Math.ceil(sparse.length / most), Math.floor((sparse.length - 1) / (need - 1))));
    const plain = sparse === fine || (powers[0] >= 1e-3 && powers[powers.length - 1] <= 1e5);
    return sparse
      .filter((_, i) => i % step === 0)
      .map((value) => [value, plain ? words(value) : superscripted(value)]);
  };

  // Round numbers within the ends, about `most`, with their words; at least three where there is
  // room for three.
  const ticksOf = (axis, low, high, most) => {
    if (axis.hidden) return [];
    if (axis.categories.length) {
      return axis.categories
        .map((name, i) => [i, name])
        .filter(([i]) => i >= low - 0.5 && i <= high + 0.5);
    }
    const need = Math.max(2, Math.min(LEAST, Math.floor(most)));
    const ticks = axis.scale === "log" ? decadeTicks(low, high, most, need) : null;
    return ticks || evenTicks(axis, low, high, most, need);
  };
  return { finite, scaleOf, ticksOf, words };
})();

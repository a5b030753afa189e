"use strict";
// Shows the values at the pointer, or at the place chosen with the arrow keys, and sorts tables.
// The page is complete without it.
(() => {
  const data = JSON.parse(document.getElementById("plot-values").textContent);
  const spaceSvg = "http://www.w3.org/2000/svg";

  const format = (value) => {
    if (value === null) return "–";
    if (value === 0) return "0";
    const size = Math.abs(value);
    const text = size >= 1e6 || size < 1e-3
      ? value.toExponential(3).replace(/e([+-])(\d+)/, (_, sign, power) => " × 10^" + (sign === "-" ? "−" : "") + power)
      : String(+value.toPrecision(5));
    return text.replace("-", "−");
  };
  const withUnit = (value, unit) => format(value) + (unit && value !== null ? " " + unit : "");

  const scale = (axis, start, end) => {
    const part = axis.log
      ? (v) => (Math.log10(v) - Math.log10(axis.low)) / (Math.log10(axis.high) - Math.log10(axis.low))
      : (v) => (v - axis.low) / (axis.high - axis.low);
    return (v) => start + part(v) * (end - start);
  };

  // Each reader turns a place in the picture into rows of text and marks to draw. A step is a move
  // by arrow key from the last place.
  const readers = {
    xy(plot) {
      const [left, top, width, height] = plot.area;
      const x = scale(plot.x, left, left + width), y = scale(plot.y, top + height, top);
      const places = plot.grids.map((grid) => grid.map((v) => (v === null ? NaN : x(v))));
      const nearest = (series, at) => {
        const xs = places[series.grid];
        let best = -1, least = Infinity;
        for (let k = 0; k < xs.length; k++) {
          if (series.y[k] === null || Number.isNaN(xs[k])) continue;
          const dx = xs[k] - at.x, dy = plot.nearest === "x" ? 0 : y(series.y[k]) - at.y;
          const far = dx * dx + dy * dy;
          if (far < least) { least = far; best = k; }
        }
        return { series, k: best, far: least };
      };
      return {
        read(at) {
          let found = plot.series.map((s) => nearest(s, at)).filter((f) => f.k >= 0);
          const least = Math.min(...found.map((f) => f.far));
          // Of series on different grids only those are shown that have a point at this place.
          found = found.filter((f) => plot.nearest === "x" ? Math.sqrt(f.far) <= Math.sqrt(least) + 2 : f.far === least);
          if (!found.length) return null;
          const first = found[0], value = plot.grids[first.series.grid][first.k];
          const rows = [[plot.x.name, withUnit(value, plot.x.unit)]];
          const marks = [];
          for (const { series, k } of found) {
            let text = withUnit(series.y[k], plot.y.unit);
            if (series.lower) text += "  [" + format(series.lower[k]) + ", " + format(series.upper[k]) + "]";
            rows.push([series.name || plot.y.name, text]);
            if (series.extra) rows.push([series.extra.name, format(series.extra.values[k])]);
            marks.push({ x: places[series.grid][k], y: y(series.y[k]) });
          }
          return { rows, marks, line: marks[0].x, at: { x: marks[0].x, y: marks[0].y }, span: [top, top + height] };
        },
        step(at, by) {
          const xs = places[plot.series[0].grid].filter((v) => !Number.isNaN(v)).sort((a, b) => a - b);
          if (!xs.length) return at;
          let k = xs.findIndex((v) => v >= at.x - 0.01);
          if (k < 0) k = xs.length - 1;
          return { x: xs[Math.max(0, Math.min(xs.length - 1, k + by))], y: at.y };
        },
        start: { x: left, y: top + height / 2 },
      };
    },
    cells(plot) {
      const [left, top, width, height] = plot.area;
      const columns = plot.x.values.length, rows = plot.rows.length;
      const bound = (k, n) => Math.max(0, Math.min(n - 1, k));
      return {
        read(at) {
          const c = bound(Math.floor(((at.x - left) / width) * columns), columns);
          const r = bound(Math.floor(((at.y - top) / height) * rows), rows);
          const mark = { x: left + ((c + 0.5) * width) / columns, y: top + ((r + 0.5) * height) / rows };
          return {
            rows: [[plot.x.name, withUnit(plot.x.values[c], plot.x.unit)], [plot.rows[r], withUnit(plot.values[r][c], plot.unit)]],
            marks: [mark], at: mark, span: [top, top + height],
          };
        },
        step: (at, by, down) => ({ x: at.x + (by * width) / columns, y: at.y + (down * height) / rows }),
        start: { x: left + width / columns / 2, y: top + height / rows / 2 },
      };
    },
    polar(plot) {
      const [cx, cy] = plot.centre, radius = scale(plot.r, 0, plot.radius);
      const at = (angle, r) => ({ x: cx + r * Math.cos(angle), y: cy - r * Math.sin(angle) });
      const turn = (a) => a - 2 * Math.PI * Math.floor(a / (2 * Math.PI));
      return {
        read(place) {
          const angle = turn(Math.atan2(cy - place.y, place.x - cx));
          const rows = [["angle", format((angle * 180) / Math.PI) + "°"]], marks = [];
          for (const series of plot.series) {
            let best = -1, least = Infinity;
            series.angle.forEach((a, k) => {
              const far = Math.abs(turn(a - angle + Math.PI) - Math.PI);
              if (series.r[k] !== null && far < least) { least = far; best = k; }
            });
            if (best < 0) continue;
            rows.push([series.name, withUnit(series.r[best], plot.r.unit)]);
            marks.push(at(series.angle[best], radius(series.r[best])));
          }
          return { rows, marks, at: at(angle, plot.radius / 2) };
        },
        step(place, by) {
          const angle = Math.atan2(cy - place.y, place.x - cx) + (by * Math.PI) / 90;
          return at(angle, plot.radius / 2);
        },
        start: { x: cx + plot.radius / 2, y: cy },
      };
    },
  };

  for (const svg of document.querySelectorAll("svg[data-values]")) {
    const plot = data[+svg.dataset.values];
    const reader = readers[plot.kind] && readers[plot.kind](plot);
    if (!reader) continue;
    const box = svg.parentElement;
    const out = document.createElement("div");
    out.className = "readout";
    out.setAttribute("role", "status");
    out.hidden = true;
    box.append(out);
    const cursor = document.createElementNS(spaceSvg, "g");
    cursor.setAttribute("class", "cursor");
    svg.append(cursor);
    let last = reader.start;

    const hide = () => { out.hidden = true; cursor.replaceChildren(); };
    const show = (at) => {
      const found = reader.read(at);
      if (!found) return hide();
      last = found.at;
      out.replaceChildren(...found.rows.map(([name, value]) => {
        const row = document.createElement("div"), label = document.createElement("span"), text = document.createElement("b");
        label.textContent = name;
        text.textContent = value;
        row.append(label, text);
        return row;
      }));
      out.hidden = false;
      const shapes = found.marks.map((m) => {
        const ring = document.createElementNS(spaceSvg, "circle");
        ring.setAttribute("cx", m.x); ring.setAttribute("cy", m.y); ring.setAttribute("r", 4.5);
        return ring;
      });
      if (found.line !== undefined) {
        const line = document.createElementNS(spaceSvg, "path");
        line.setAttribute("d", `M${found.line} ${found.span[0]}V${found.span[1]}`);
        shapes.push(line);
      }
      cursor.replaceChildren(...shapes);
      const view = svg.viewBox.baseVal, grow = svg.clientWidth / view.width;
      const place = found.at.x * grow, beside = place + 14 + out.offsetWidth <= box.clientWidth;
      out.style.left = Math.max(0, beside ? place + 14 : place - 14 - out.offsetWidth) + "px";
      out.style.top = Math.max(0, Math.min(found.at.y * grow - out.offsetHeight - 10, svg.clientHeight - out.offsetHeight)) + "px";
    };
    const place = (event) => {
      const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      return { x: point.x, y: point.y };
    };
    svg.addEventListener("pointermove", (event) => show(place(event)));
    svg.addEventListener("pointerdown", (event) => show(place(event)));
    svg.addEventListener("pointerleave", hide);
    svg.addEventListener("blur", hide);
    svg.addEventListener("keydown", (event) => {
      const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
      if (event.key === "Escape") return hide();
      const step = steps[event.key];
      if (!step) return;
      event.preventDefault();
      show(out.hidden ? last : reader.step(last, ...step));
    });
  }

  for (const head of document.querySelectorAll("thead th")) {
    const button = document.createElement("button");
    button.append(...head.childNodes);
    button.title = "Sort by this column";
    head.append(button);
    button.addEventListener("click", () => {
      const body = head.closest("table").tBodies[0], k = head.cellIndex;
      const down = head.getAttribute("aria-sort") === "ascending";
      const key = (row) => { const v = row.cells[k].dataset.value; return v === undefined ? row.cells[k].textContent : +v; };
      const order = (a, b) => (typeof a === typeof b ? (a < b ? -1 : a > b ? 1 : 0) : typeof a === "number" ? 1 : -1);
      const rows = [...body.rows].sort((a, b) => order(key(a), key(b)) * (down ? -1 : 1));
      body.append(...rows);
      for (const other of head.parentElement.cells) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
    });
  }
})();

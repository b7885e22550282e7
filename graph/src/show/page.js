"use strict";
(() => {
  const { passes, resources } = JSON.parse(document.getElementById("data").textContent);
  const all = (selector, root = document) => [...root.querySelectorAll(selector)];
  const panel = document.getElementById("facts");
  const hint = [...panel.childNodes];
  const drawings = all(".dag, .timeline");

  // What belongs to each pass and resource.
  const group = (selector, key) => {
    const found = new Map();
    for (const element of all(selector)) {
      const id = Number(element.dataset[key]);
      found.set(id, [...(found.get(id) || []), element]);
    }
    return found;
  };
  const ofPass = group("[data-p]", "p");
  const ofResource = group("[data-r]", "r");
  const flows = [];
  for (const line of all(".line[data-flow]")) {
    for (const flow of line.dataset.flow.split(",")) {
      const [from, to, resource] = flow.split(" ").map(Number);
      flows.push({ from, to, resource, line });
    }
  }
  const users = resources.map(() => []);
  passes.forEach((pass, p) => pass.uses.forEach((use) => users[use.r].push({ ...use, p })));

  // Highlights.
  let lit = [];
  let chosen = null;
  const light = (element, name) => {
    element.classList.add(name);
    lit.push([element, name]);
  };
  const lightAll = (map, id, name) => (map.get(id) || []).forEach((element) => light(element, name));
  const clear = () => {
    lit.forEach(([element, name]) => element.classList.remove(name));
    lit = [];
  };
  const show = (kind, id) => {
    clear();
    const pass = kind === "p";
    const map = pass ? ofPass : ofResource;
    drawings.forEach((drawing) => light(drawing, "dim"));
    lightAll(map, id, "on");
    lightAll(map, id, "at");
    for (const flow of flows) {
      if (pass ? flow.from === id || flow.to === id : flow.resource === id) {
        light(flow.line, "on");
        lightAll(ofPass, flow.from, "on");
        lightAll(ofPass, flow.to, "on");
      }
    }
    if (pass) passes[id].uses.forEach((use) => lightAll(ofResource, use.r, "on"));
    else users[id].forEach((use) => lightAll(ofPass, use.p, "on"));
    panel.replaceChildren(...(pass ? passFacts(passes[id]) : resourceFacts(resources[id], users[id])));
    panel.classList.add("open");
    panel.scrollTop = 0;
  };
  const restore = () => {
    if (chosen) return show(...chosen);
    clear();
    panel.replaceChildren(...hint);
    panel.classList.remove("open");
  };
  const choose = (kind, id) => {
    chosen = kind ? [kind, id] : null;
    restore();
  };

  // The panel.
  const make = (tag, text, ...children) => {
    const element = document.createElement(tag);
    if (text) element.textContent = text;
    element.append(...children);
    return element;
  };
  const link = (kind, id, name, remark) => {
    const button = make("button", name);
    if (remark) button.append(" ", make("small", remark));
    button.type = "button";
    button.onclick = () => {
      choose(kind, id);
      reveal(kind, id);
    };
    return make("li", "", button);
  };
  const list = (title, items) => (items.length ? [make("h3", title), make("ul", "", ...items)] : []);
  const remark = (use, name) => [use.as === name ? "" : use.as, use.part].filter(Boolean).join(", ");
  const passFacts = (pass) => {
    const at = pass.at === null ? "culled" : `position ${pass.at}`;
    const use = (u) => link("r", u.r, resources[u.r].name, remark(u, resources[u.r].name));
    return [
      make("h2", pass.name),
      make("p", [pass.kind, at, ...pass.marks].join(", ")),
      ...(pass.why ? [make("p", `Culled: ${pass.why}`)] : []),
      ...(pass.time ? [make("p", `GPU time ${pass.time}`)] : []),
      ...(pass.live ? [make("p", `${pass.live} of transient resources in use`)] : []),
      ...list("reads", pass.uses.filter((u) => u.in).map(use)),
      ...list("writes", pass.uses.filter((u) => u.out).map(use)),
      ...(pass.place ? [make("h3", "declared at"), make("p", "", make("small", pass.place))] : []),
    ];
  };
  const resourceFacts = (resource, uses) => {
    const use = (u) => link("p", u.p, passes[u.p].name, [u.part, passes[u.p].at === null ? "culled" : ""].filter(Boolean).join(", "));
    const facts = [resource.origin, resource.bytes, resource.life && `in use from position ${resource.life}`];
    return [
      make("h2", resource.name),
      make("p", resource.what),
      make("p", facts.filter(Boolean).join(", ")),
      ...(resource.slot ? [make("p", `slot ${resource.slot}`)] : []),
      ...list("written by", uses.filter((u) => u.out).map(use)),
      ...list("read by", uses.filter((u) => u.in).map(use)),
      ...(resource.place ? [make("h3", "declared at"), make("p", "", make("small", resource.place))] : []),
    ];
  };
  const reveal = (kind, id) => {
    const first = ((kind === "p" ? ofPass : ofResource).get(id) || [])[0];
    const box = first && first.closest(".scroll");
    if (!box) return;
    const [inner, outer] = [first.getBoundingClientRect(), box.getBoundingClientRect()];
    const clear = (from, to, low, high) => (from < low || to > high ? (from + to - low - high) / 2 : 0);
    box.scrollBy(clear(inner.left, inner.right, outer.left, outer.right), clear(inner.top, inner.bottom, outer.top, outer.bottom));
  };

  // Pointer: hover shows, a click stays, a click beside it ends that.
  const target = (event) => {
    const element = event.target.closest ? event.target.closest("[data-p], [data-r]") : null;
    if (!element || element.closest("#facts")) return null;
    return "p" in element.dataset ? ["p", Number(element.dataset.p)] : ["r", Number(element.dataset.r)];
  };
  let shown = "";
  document.addEventListener("pointerover", (event) => {
    if (event.pointerType === "touch" || panning || event.target.closest("#facts")) return;
    const found = target(event);
    const key = found ? found.join() : "";
    if (key === shown) return;
    shown = key;
    if (found) show(...found);
    else restore();
  });
  document.addEventListener("click", (event) => {
    if (moved || event.target.closest("#facts, button")) return;
    const found = target(event);
    if (found) choose(...found);
    else choose(null);
  });

  // Keys: one stop for the passes and one for the resources, arrows within.
  const rove = (elements, kind) => {
    if (!elements.length) return;
    elements[0].tabIndex = 0;
    elements.forEach((element, at) => {
      element.addEventListener("focus", () => show(kind, Number(element.dataset[kind])));
      element.addEventListener("blur", restore);
      element.addEventListener("keydown", (event) => {
        const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
        const to = { Home: 0, End: elements.length - 1 }[event.key] ?? (step ? at + step : null);
        if (event.key === "Enter" || event.key === " ") choose(kind, Number(element.dataset[kind]));
        else if (to === null || !elements[to]) return;
        else {
          element.tabIndex = -1;
          elements[to].tabIndex = 0;
          elements[to].focus();
        }
        event.preventDefault();
      });
    });
  };
  const inOrder = (p) => (passes[p].at === null ? passes.length + p : passes[p].at);
  rove(all(".dag .pass").sort((a, b) => inOrder(Number(a.dataset.p)) - inOrder(Number(b.dataset.p))), "p");
  rove(all(".timeline .block"), "r");
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") choose(null);
  });

  // Zoom and pan of the graph.
  const canvas = document.querySelector(".canvas");
  const dag = document.querySelector(".dag");
  let panning = null;
  let moved = false;
  if (dag) {
    const [, , width, height] = dag.getAttribute("viewBox").split(" ").map(Number);
    let zoom = 1;
    const set = (value, x = canvas.clientWidth / 2, y = canvas.clientHeight / 2) => {
      const next = Math.min(4, Math.max(0.05, value));
      const [left, top] = [(canvas.scrollLeft + x) / zoom, (canvas.scrollTop + y) / zoom];
      zoom = next;
      dag.setAttribute("width", width * zoom);
      dag.setAttribute("height", height * zoom);
      canvas.scrollTo(left * zoom - x, top * zoom - y);
    };
    const fit = () => Math.min(1, (canvas.clientWidth - 4) / width);
    const tools = document.querySelector(".tools");
    tools.hidden = false;
    tools.addEventListener("click", (event) => {
      const how = event.target.dataset.zoom;
      if (how) set({ in: zoom * 1.25, out: zoom / 1.25, fit: fit(), one: 1 }[how]);
    });
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      const box = canvas.getBoundingClientRect();
      set(zoom * Math.exp(-event.deltaY / 400), event.clientX - box.left, event.clientY - box.top);
    }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => {
      moved = false;
      if (event.pointerType !== "mouse" || event.button !== 0) return;
      panning = [event.clientX, event.clientY, canvas.scrollLeft, canvas.scrollTop];
    });
    addEventListener("pointermove", (event) => {
      if (!panning) return;
      const [x, y] = [event.clientX - panning[0], event.clientY - panning[1]];
      if (Math.abs(x) + Math.abs(y) > 4) {
        moved = true;
        canvas.classList.add("panning");
      }
      if (moved) canvas.scrollTo(panning[2] - x, panning[3] - y);
    });
    addEventListener("pointerup", () => {
      panning = null;
      canvas.classList.remove("panning");
      setTimeout(() => (moved = false));
    });
    // Large graphs begin at a size that can still be read.
    set(Math.max(fit(), 0.6));
    canvas.scrollTo((width * zoom - canvas.clientWidth) / 2, 0);
  }
  // `page.html#pass=NAME` and `#resource=NAME` open with it chosen.
  const open = () => {
    const [what, name] = decodeURIComponent(location.hash.slice(1)).split(/=(.*)/);
    const found = { pass: passes, resource: resources }[what]?.findIndex((entry) => entry.name === name) ?? -1;
    if (found < 0) return;
    choose(what[0], found);
    reveal(what[0], found);
  };
  addEventListener("hashchange", open);
  open();

  document.documentElement.dataset.ready = String(passes.length);
})();

// The keys, and the help that lists them.
"use strict";

/** Keys with their names for people, what they do, and the action. */
function keysOf({motion, view, panel, help, fit}) {
    const flip = (id) => () => panel.choose(id, !byId(id).checked);
    return [
        {keys: [" "], names: "Space", text: "Play or pause", act: () => motion.toggle()},
        {keys: ["ArrowLeft", "ArrowRight"], names: "← →", text: "One frame back or on; with Shift, ten",
            act: (event) => motion.step((event.key === "ArrowLeft" ? -1 : 1) * (event.shiftKey ? 10 : 1))},
        {keys: ["Home", "End"], names: "Home End", text: "First or last frame",
            act: (event) => motion.step(event.key === "Home" ? -Infinity : Infinity)},
        {keys: ["j", "l"], names: "J L", text: "Turn left or right", act: ({key}) => view.orbit(key === "j" ? -8 : 8, 0)},
        {keys: ["i", "k"], names: "I K", text: "Turn up or down", act: ({key}) => view.orbit(0, key === "i" ? 6 : -6)},
        {keys: ["+", "=", "-"], names: "+ −", text: "Nearer or farther", act: ({key}) => view.zoom(key === "-" ? 1.15 : 1 / 1.15)},
        {keys: ["f"], names: "F", text: "Look at everything again", act: fit},
        {keys: ["c"], names: "C", text: "Next colouring", act: () => panel.nextColour()},
        {keys: ["b"], names: "B", text: "Show or hide the tree's bounds", act: flip("show-bounds")},
        {keys: ["[", "]"], names: "[ ]", text: "Bounds one level up or down", act: ({key}) => panel.deeper(key === "[" ? -1 : 1)},
        {keys: ["r"], names: "R", text: "Show or hide arrows of reactions", act: flip("show-reactions")},
        {keys: ["n"], names: "N", text: "Mark near faces", act: flip("mark-near")},
        {keys: ["t"], names: "T", text: "Mark intersecting faces", act: flip("mark-intersecting")},
        {keys: ["x"], names: "X", text: "See through the bodies or not",
            act: () => panel.choose("see-through", Number(byId("see-through").value) > 0 ? 0 : 60)},
        {keys: ["p"], names: "P", text: "Show or hide the settings", act: () => panel.open(byId("panel").hidden)},
        {keys: ["?", "h"], names: "? H", text: "Show or close this help", act: () => help.open ? help.close() : help.showModal()},
    ];
}

function listen(keys, help) {
    const table = help.querySelector("tbody");
    for (const {names, text} of keys) {
        const row = table.insertRow(), head = document.createElement("th");
        head.scope = "row";
        head.append(...names.split(" ").map((name) => Object.assign(document.createElement("kbd"), {textContent: name})));
        row.append(head);
        row.insertCell().textContent = text;
    }
    document.addEventListener("keydown", (event) => {
        if (event.ctrlKey || event.metaKey || event.altKey) return;
        const found = keys.find((key) => key.keys.includes(event.key.length === 1 ? event.key.toLowerCase() : event.key));
        const focused = event.target;
        // A focused control keeps the keys with which it is used, except for Space on the slider of frames.
        const isControl = focused.matches("select, input, button") && focused.id !== "frame";
        const usesIt = [" ", "ArrowLeft", "ArrowRight", "Home", "End", "Enter"].includes(event.key) || focused.matches("select");
        if (!found || (isControl && usesIt) || (help.open && found.keys[0] !== "?")) return;
        event.preventDefault();
        found.act(event);
    });
}

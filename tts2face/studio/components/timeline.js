// The timeline: spans of styles as text.

export default {
  template: `
    <section aria-label="Timeline" style="overflow: auto">
      <p v-for="span in timeline.spans ?? []">{{ span.feature }} {{ span.style }} {{ span.start }} - {{ span.end }}</p>
    </section>`,
  props: { timeline: Object, styles: Array, brush: Object, lanes: Array, compare: String },
  emits: ["edit"],
};

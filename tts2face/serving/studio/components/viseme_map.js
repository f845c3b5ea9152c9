// Map of the visemes: how much of running text the accepted takes cover, for each viseme and the viseme behind it.
const CELL = 22;
const LEFT = 118;
const TOP = 34;

export default {
  template: `
    <figure class="viseme-map">
      <svg :viewBox="'0 0 ' + width + ' ' + height" role="img" :aria-label="summary">
        <text v-for="(name, n) in behind" :key="'t' + n" :x="left + (n + 0.5) * cell" :y="top - 8" text-anchor="middle">{{ name }}</text>
        <g v-for="(row, m) in rows" :key="row.name">
          <text :x="34" :y="top + (m + 0.7) * cell" text-anchor="end" class="viseme-name">{{ row.name }}</text>
          <text :x="40" :y="top + (m + 0.7) * cell"><tspan v-for="phone in row.phones" :key="phone.name" dx="4"
            :class="phone.isCovered ? 'phone-covered' : 'phone-missing'">{{ phone.name }}</tspan></text>
          <rect v-for="(cellOf, n) in row.cells" :key="n" v-show="cellOf.of" :x="left + n * cell + 1" :y="top + m * cell + 1"
            :width="cell - 2" :height="cell - 2" rx="3" :fill-opacity="0.08 + 0.92 * cellOf.share"><title>{{ row.name }} before {{ behind[n] }}: {{ Math.round(100 * cellOf.share) }} %</title></rect>
        </g>
      </svg>
      <figcaption>{{ summary }}</figcaption>
    </figure>`,
  props: { prompts: Array, running: Object, accepted: Array, visemes: Object },
  data: () => ({ cell: CELL, left: LEFT, top: TOP }),
  computed: {
    behind() {
      return [...new Set(Object.keys(this.running.triphones).map((name) => name.split(" ")[2]))].sort();
    },
    covered() {
      const phones = new Set();
      const triphones = new Set();
      for (const at of this.accepted) {
        this.prompts[at].phones.forEach((one) => phones.add(one));
        this.prompts[at].triphones.forEach((one) => triphones.add(one));
      }
      return { phones, triphones };
    },
    rows() {
      const rows = new Map();
      const row = (name) => {
        if (!rows.has(name)) rows.set(name, { name, phones: [], cells: this.behind.map(() => ({ n: 0, of: 0, share: 0 })) });
        return rows.get(name);
      };
      for (const [name, count] of Object.entries(this.running.triphones)) {
        const [, here, behind] = name.split(" ");
        const cell = row(here.split("-")[0]).cells[this.behind.indexOf(behind)];
        cell.of += count;
        if (this.covered.triphones.has(name)) cell.n += count;
        cell.share = cell.n / cell.of;
      }
      for (const phone of Object.keys(this.running.phones))
        row(this.visemes[phone]).phones.push({ name: phone, isCovered: this.covered.phones.has(phone) });
      return [...rows.values()].sort((a, b) => (a.name < b.name ? -1 : 1));
    },
    width() {
      return LEFT + CELL * this.behind.length + 4;
    },
    height() {
      return TOP + CELL * this.rows.length + 4;
    },
    summary() {
      let n = 0;
      let of = 0;
      for (const [name, count] of Object.entries(this.running.triphones)) {
        of += count;
        if (this.covered.triphones.has(name)) n += count;
      }
      const phones = Object.keys(this.running.phones);
      const spoken = phones.filter((one) => this.covered.phones.has(one)).length;
      return `${spoken} of ${phones.length} phones; ${((100 * n) / Math.max(of, 1)).toFixed(1)} % of the phone contexts of running text`;
    },
  },
};

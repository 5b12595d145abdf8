// avr8js_serial.js: runs a firmware image in avr8js; its serial line is this process's input and output.
//
// node avr8js_serial.js FOLDER-OF-THE-PACKAGE IMAGE.bin
'use strict';

const fs = require('fs');
const path = require('path');
const { uno } = require('./tests/calibration/avr8js_run.js');

const STEPS = 20000; // instructions between two looks at the input

const [folder, image] = process.argv.slice(2);
const avr8js = require(path.resolve(folder));
const { cpu, usart } = uno(avr8js, Array.from(fs.readFileSync(image)));
const waiting = [];

usart.onByteTransmit = (byte) => process.stdout.write(Buffer.of(byte));
process.stdin.on('data', (bytes) => waiting.push(...bytes));
process.stdin.on('end', () => process.exit(0));

function run() {
  for (let i = 0; i < STEPS; i++) {
    avr8js.avrInstruction(cpu);
    cpu.tick();
    if (waiting.length && usart.writeByte(waiting[0])) waiting.shift();
  }
  setImmediate(run);
}
run();

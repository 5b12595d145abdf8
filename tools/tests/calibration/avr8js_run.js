// avr8js_run.js: runs the calibration program in avr8js; prints what it sent, and when pin 13 changed.
//
// calibrate(avr8js, flash, answers, quiet): `flash` holds the program's bytes, `answers` what the program may ask for;
// it is given up when it has sent nothing for `quiet` cycles. Returns the bytes sent with their cycles and the cycles of
// the edges.
//
// By node: node avr8js_run.js FOLDER-OF-THE-PACKAGE PROGRAM.bin ANSWERS QUIET, result as JSON.
'use strict';

// An Uno that is about to run those bytes: its processor, its port B, its UART.
function uno(avr8js, flash) {
  const words = new Uint16Array(16384);
  flash.forEach((byte, i) => { words[i >> 1] |= byte << (8 * (i & 1)); });
  const cpu = new avr8js.CPU(words);
  for (const config of [avr8js.timer0Config, avr8js.timer1Config, avr8js.timer2Config]) new avr8js.AVRTimer(cpu, config);
  const portB = new avr8js.AVRIOPort(cpu, avr8js.portBConfig);
  new avr8js.AVRIOPort(cpu, avr8js.portCConfig);
  new avr8js.AVRIOPort(cpu, avr8js.portDConfig);
  const clock = new avr8js.AVRClock(cpu, 16e6);
  new avr8js.AVRWatchdog(cpu, avr8js.watchdogConfig, clock);
  new avr8js.AVRADC(cpu, avr8js.adcConfig);
  new avr8js.AVREEPROM(cpu, new avr8js.EEPROMMemoryBackend(1024));
  new avr8js.AVRTWI(cpu, avr8js.twiConfig, 16e6);
  return { cpu, portB, usart: new avr8js.AVRUSART(cpu, avr8js.usart0Config, 16e6) };
}

function calibrate(avr8js, flash, answers, quiet) {
  const { cpu, portB, usart } = uno(avr8js, flash);
  const result = { bytes: [], byte_cycles: [], edge_cycles: [] };
  const waiting = ['?'.charCodeAt(0)];
  let text = '';
  let heard = 0;
  let ended = false;
  usart.onByteTransmit = (byte) => {
    heard = cpu.cycles;
    result.bytes.push(byte);
    result.byte_cycles.push(cpu.cycles);
    if (byte !== 10) { text += String.fromCharCode(byte); return; }
    const asked = /^>([0-9])$/.exec(text);
    if (asked) waiting.push(...answers.slice(0, Number(asked[1])));
    ended = text === 'end';
    text = '';
  };
  let mark = 0;
  portB.addListener((value) => {
    if ((value ^ mark) & 0x20) result.edge_cycles.push(cpu.cycles);
    mark = value;
  });
  while (!ended && cpu.cycles < heard + quiet) {
    for (let i = 0; i < 100; i++) {
      avr8js.avrInstruction(cpu);
      cpu.tick();
    }
    if (waiting.length && usart.writeByte(waiting[0])) waiting.shift();
  }
  return result;
}

if (typeof require === 'function' && typeof module === 'object' && require.main === module) {
  const fs = require('fs');
  const path = require('path');
  const [folder, program, answers, quiet] = process.argv.slice(2);
  const avr8js = require(path.resolve(folder));
  const flash = Array.from(fs.readFileSync(program));
  process.stdout.write(JSON.stringify(calibrate(avr8js, flash, Array.from(Buffer.from(answers)), Number(quiet))));
}

if (typeof module === 'object') module.exports = { uno };

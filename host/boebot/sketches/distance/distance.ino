/* distance: drives up to a wall and stops 20 cm before it.
   Robot shieldbot, arena room.

   A Ping))) sends a chirp when its pin gets a short pulse, and then makes a pulse as long as the sound takes to the
   wall and back: 58 us for each cm. */
#include <Servo.h>

const int PING = 8;
Servo left, right;
int cm;  // to what is before the sensor

// Distance (cm) of what is before the sensor; 300 if there is no echo.
int distance() {
  pinMode(PING, OUTPUT);
  digitalWrite(PING, HIGH);
  delayMicroseconds(5);
  digitalWrite(PING, LOW);
  pinMode(PING, INPUT);
  unsigned long echo = pulseIn(PING, HIGH, 25000);
  return echo == 0 ? 300 : echo / 58;
}

void setup() {
  Serial.begin(9600);
  left.attach(13);
  right.attach(12);
}

void loop() {
  cm = distance();
  int speed = constrain(10 * (cm - 15), 0, 200);  // the nearer, the slower
  left.writeMicroseconds(1500 + speed);
  right.writeMicroseconds(1500 - speed);
  if (cm <= 20) {
    left.detach();  // without pulses the servos rest
    right.detach();
    Serial.print("stopped at ");
  }
  Serial.print(cm);
  Serial.println(" cm");
  delay(50);
}

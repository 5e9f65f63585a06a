#!/usr/bin/env python3
"""Receives UDP datagrams with JSON as PlotJuggler's server does, independently of upright.

  udp_receiver.py PORT_FILE OUT_FILE

Listens on a free port of this machine, writes its number to PORT_FILE, and writes each datagram as a line to OUT_FILE until
none came for two seconds after the first one (60 s for the first).
"""
import json
import os
import socket
import sys

port_file, out_file = sys.argv[1:]
receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
receiver.bind(("127.0.0.1", 0))
receiver.settimeout(60)
with open(port_file + ".new", "w") as file:
    file.write(str(receiver.getsockname()[1]))
os.rename(port_file + ".new", port_file)
with open(out_file, "w") as out:
    while True:
        try:
            data = receiver.recv(65536)
        except socket.timeout:
            break
        receiver.settimeout(2)
        out.write(json.dumps(json.loads(data, parse_constant=lambda name: sys.exit(f"{name} is no JSON"))) + "\n")

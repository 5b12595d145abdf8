"""The ports of this computer behind which a board may be: serial lines and ptys, TCP sockets, RFC 2217 servers.

`open_serial`, `open_socket` and `open_rfc2217` each give a Transport (boebot.link.transport).
"""

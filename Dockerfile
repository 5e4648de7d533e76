# Two images out of one build: `docker build --target server .` and `--target client .`.
# Plain instructions only, so that the classic builder (docker-compose 1.29) can build it too.
# Both bases can be replaced; they must agree on the C library.
ARG BASE_BUILD=rust:1.95-bookworm
ARG BASE_RUN=debian:bookworm-slim

FROM ${BASE_BUILD} AS build
WORKDIR /src
COPY . .
# No display, no window: the client is built without it.
RUN cargo build --release --locked --bins --package fea-server --package glove-client --no-default-features \
    --features fea-server/otlp,glove-client/otlp

FROM ${BASE_RUN} AS run
WORKDIR /out
# Numbers, not names: the base needs no user of ours.
RUN chown 65532:65532 /out
USER 65532:65532

FROM run AS server
COPY --from=build /src/target/release/fea-server /usr/local/bin/fea-server
EXPOSE 7878
# Looks for the listening socket (1EC6 is 7878, 0A is "listen") instead of connecting, which
# would be a session in the log every few seconds. Change it together with --listen.
HEALTHCHECK --interval=3s --timeout=2s --retries=20 \
    CMD ["grep", "-qE", ":1EC6 [0-9A-F]+:0000 0A", "/proc/net/tcp"]
ENTRYPOINT ["fea-server"]
# A network of containers is trusted; anything else wants --token-file and --tls-cert, --tls-key.
CMD ["--listen", "0.0.0.0:7878", "--insecure"]

FROM run AS client
COPY --from=build /src/target/release/glove-client /usr/local/bin/glove-client
# Reports and deformed objects go here; a volume mounted here inherits the owner.
VOLUME ["/out"]
ENTRYPOINT ["glove-client"]
CMD ["run", "--headless"]
